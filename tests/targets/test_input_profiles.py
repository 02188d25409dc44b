"""Profiles of an input: what they are at every time, their text, and what is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mcmj.targets.input_profiles import Profile, Ramp, hold
from mcmj.utils.errors import InvalidArgumentError

values = st.floats(1e-3, 1e3)
durations = st.floats(1e-2, 1e3)
ramps = st.builds(Ramp, values, values, durations, geometric=st.booleans())


@given(ramps, st.floats(0, 1))
def test_a_ramp_goes_from_start_to_stop_evenly(ramp, share):
    ends = ramp([0.0, ramp.duration])
    np.testing.assert_allclose(ends, [ramp.start, ramp.stop], rtol=1e-12)
    at = ramp(share * ramp.duration)
    if ramp.geometric:  # equal ratios: log u is linear
        line = (1 - share) * np.log(ramp.start) + share * np.log(ramp.stop)
        assert np.log(at) == pytest.approx(line, abs=1e-9)
    else:
        line = (1 - share) * ramp.start + share * ramp.stop
        assert at == pytest.approx(line, rel=1e-9)
    assert np.array_equal(ramp([-1.0, 2 * ramp.duration]), ends)


@given(st.lists(ramps, min_size=1, max_size=5))
def test_a_profile_is_its_ramps_one_after_the_other(parts):
    profile = Profile(parts)
    assert profile.duration == pytest.approx(sum(ramp.duration for ramp in parts))
    start = 0.0
    for ramp in parts:
        inside = np.linspace(0.01, 0.99, 7) * ramp.duration
        np.testing.assert_allclose(profile(start + inside), ramp(inside), rtol=1e-6)
        start += ramp.duration
    everywhere = profile(np.linspace(-1.0, start + 1.0, 101))
    assert profile.low * (1 - 1e-12) <= everywhere.min()
    assert everywhere.max() <= profile.high * (1 + 1e-12)
    assert profile(start + 1.0) == pytest.approx(profile.last)


@given(st.lists(ramps, min_size=1, max_size=5))
def test_text_gives_the_profile_back(parts):
    profile = Profile(parts)
    again = Profile.parse(str(profile))
    times = np.linspace(0.0, profile.duration, 50)
    np.testing.assert_allclose(again(times), profile(times), rtol=1e-12)
    assert str(again) == str(profile)


def test_where_ramps_do_not_meet_the_input_jumps():
    profile = Profile([hold(5.0, 2.0), hold(1.0, 3.0)])
    assert profile([1.999, 2.0, 2.001]).tolist() == [5.0, 1.0, 1.0]
    assert (profile.low, profile.high, profile.last) == (1.0, 5.0, 1.0)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Ramp(0.0, 1.0, 2.0, geometric=True), "start of a geometric ramp: expected a"),
        (lambda: Ramp(1.0, 2.0, 0.0), r"duration: expected a number in \(0, inf\], got 0"),
        (lambda: Ramp(np.nan, 2.0, 1.0), "start: expected a number"),
        (lambda: Profile([]), "ramps: expected at least one Ramp"),
        (lambda: Profile(["lin 1 2 3"]), "ramps: expected at least one Ramp, and only ramps"),
        (lambda: Profile.parse(""), "profile: expected parts like lin START STOP SECONDS"),
        (lambda: Profile.parse("hold 1 2 3"), "hold VALUE SECONDS, got 'hold 1 2 3'"),
        (lambda: Profile.parse("lin 1 2 3, sine 1 2 3"), "got ' sine 1 2 3'"),
        (lambda: Profile.parse("lin a 2 3"), "got 'lin a 2 3'"),
    ],
)
def test_bad_profiles_are_refused(make, text):
    with pytest.raises(InvalidArgumentError, match=text):
        make()
