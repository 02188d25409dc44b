"""MJCF -> Body: what was written is read back to the bit."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import mcmj
from mcmj import Body, from_mjcf, to_mjcf
from mcmj.mjcf.kept import provenance_of_model, spring_law_of_model
from mcmj.mjcf.read import load_model, readouts_of_model
from mcmj.utils.errors import InvalidArgumentError

FIELDS = tuple(Body.__dataclass_fields__)


def same_bits(one, other):
    return all(
        getattr(one, name).dtype == getattr(other, name).dtype
        and getattr(one, name).shape == getattr(other, name).shape
        and getattr(one, name).tobytes() == getattr(other, name).tobytes()
        for name in FIELDS
    )


def reals(low, high):
    # adding 0.0 turns -0.0 into 0.0
    return st.floats(low, high, allow_subnormal=False).map(lambda x: x + 0.0)


@st.composite
def bodies(draw):
    """Any valid body, in the plane or in space: a random tree of springs and some more, any
    numbers, any fixed nodes, pushed along any direction."""
    n, dimensions = draw(st.integers(2, 6)), draw(st.sampled_from([2, 3]))
    positions = draw(arrays(float, (n, dimensions), elements=reals(-1e5, 1e5), unique=True))
    tree = {(draw(st.integers(0, i - 1)), i) for i in range(1, n)}
    pairs = st.tuples(st.integers(0, n - 1), st.integers(0, n - 1))
    more = {tuple(sorted(p)) for p in draw(st.sets(pairs, max_size=4)) if p[0] != p[1]}
    springs = np.array(draw(st.permutations(sorted(tree | more))))
    flipped = draw(arrays(bool, len(springs)))
    springs[flipped] = springs[flipped][:, ::-1]
    fixed = draw(arrays(bool, n).filter(lambda f: not f.all()))
    channels = st.integers(0, 2)
    weights = st.one_of(st.just(0.0), reals(-1e3, 1e3), reals(-1e-300, 1e-300))
    positive, from_zero = reals(1e-6, 1e6), st.one_of(st.just(0.0), reals(1e-9, 1e9))
    return Body(
        positions=positions,
        springs=springs,
        fixed=fixed,
        rest_lengths=draw(arrays(float, len(springs), elements=positive)),
        masses=draw(arrays(float, n, elements=positive)),
        w_in=draw(arrays(float, (n, draw(channels)), elements=weights)),
        w_fb=draw(arrays(float, (n, draw(channels)), elements=weights)),
        k1=draw(arrays(float, len(springs), elements=positive)),
        d1=draw(arrays(float, len(springs), elements=positive)),
        k3=draw(arrays(float, len(springs), elements=from_zero)),
        d3=draw(arrays(float, len(springs), elements=from_zero)),
        direction=draw(st.none() | directions(dimensions)),
    )


def directions(dimensions):
    return arrays(float, dimensions, elements=st.one_of(st.just(0.0), reals(-9, 9))).filter(any)


def readouts(body, rows):
    return arrays(float, (rows, body.n_outputs), elements=reals(-1e9, 1e9))


@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow])
@given(
    data=st.data(),
    body=bodies(),
    springs=st.sampled_from(["native", "cubic", "tansig"]),
    bias=st.booleans(),
    with_readout=st.booleans(),
)
def test_round_trip_is_exact_to_the_bit(data, body, springs, bias, with_readout):
    w_out = data.draw(readouts(body, body.n_springs + bias)) if with_readout else None
    again, w_again = from_mjcf(to_mjcf(body, w_out=w_out, springs=springs))
    assert same_bits(again, body)
    if w_out is None or body.n_outputs == 0:
        assert w_again is None
    else:
        assert w_again.tobytes() == w_out.tobytes()
        assert w_again.shape == w_out.shape


def test_round_trip_of_the_test_body_keeps_what_fixed_nodes_carry(body):
    assert body.w_fb[body.fixed].all()
    assert (body.masses[body.fixed] != 1.0).all()
    assert same_bits(from_mjcf(to_mjcf(body))[0], body)


def test_writing_again_gives_the_same_text(body, w_bias):
    text = to_mjcf(body, w_out=w_bias)
    assert to_mjcf(*from_mjcf(text)[:1], w_out=from_mjcf(text)[1]) == text


def test_a_file_reads_like_its_text(tmp_path, body, w_out):
    path = tmp_path / "body.xml"
    path.write_text(to_mjcf(body, w_out=w_out))
    for source in (path, str(path), "\n  " + path.read_text()):
        again, w_again = from_mjcf(source)
        assert same_bits(again, body)
        assert w_again.tobytes() == w_out.tobytes()


def test_named_readouts_are_kept(body, w_out, w_bias):
    text = to_mjcf(body, readouts={"van_der_pol": w_out, "with bias/2": w_bias})
    kept = readouts_of_model(load_model(text))
    assert kept.keys() == {"van_der_pol", "with bias/2"}
    assert np.array_equal(kept["van_der_pol"], w_out)
    assert np.array_equal(kept["with bias/2"], w_bias)
    assert from_mjcf(text)[1] is None


def test_named_readouts_of_a_large_body_are_kept():
    """Custom numeric fields of MJCF hold at most 500 numbers."""
    body = mcmj.random_body(0, nodes=120)
    w_out = np.random.default_rng(0).normal(size=(body.n_springs, 2))
    assert w_out.size > 500
    kept = readouts_of_model(load_model(to_mjcf(body, readouts={"a": w_out})))
    assert np.array_equal(kept["a"], w_out)


def test_readout_of_a_large_body_is_kept():
    body = mcmj.random_body(0, nodes=300)
    w_out = np.random.default_rng(0).normal(size=(body.n_springs, 2))
    again, w_again = from_mjcf(to_mjcf(body, w_out=w_out))
    assert same_bits(again, body)
    assert np.array_equal(w_again, w_out)


def test_many_fixed_nodes_keep_their_masses_and_weights():
    n = 600
    x = np.arange(n, dtype=float)
    body = Body(
        positions=np.column_stack([x, np.zeros(n)]),
        springs=np.column_stack([np.arange(n - 1), np.arange(1, n)]),
        **{name: np.ones(n - 1) for name in ("k1", "k3", "d1", "d3")},
        fixed=x > 0,
        masses=1.0 + x,
        w_fb=np.column_stack([x, -x]),
    )
    assert same_bits(from_mjcf(to_mjcf(body))[0], body)


accounts = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
)


@settings(max_examples=20)
@given(account=st.dictionaries(st.text(), accounts, max_size=4))
def test_provenance_is_kept(oscillator, account):
    assert provenance_of_model(load_model(to_mjcf(oscillator, provenance=account))) == account


def test_no_provenance(body):
    assert provenance_of_model(load_model(to_mjcf(body))) is None


def test_provenance_that_is_not_json_is_a_named_error(body):
    with pytest.raises(InvalidArgumentError, match="provenance"):
        to_mjcf(body, provenance={"made by": object()})


@pytest.mark.parametrize("law", ["native", "cubic", "tansig"])
def test_spring_law_is_kept(body, law):
    assert spring_law_of_model(load_model(to_mjcf(body, springs=law))) == law
