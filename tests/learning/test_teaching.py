"""Teacher forcing: the regression it does, its noise, its memory, and that it works."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
import twins

import mcmj
from mcmj import Simulation, Teaching, fit_readout, teach
from mcmj.learning import teaching
from mcmj.learning.lessons import Lesson, TeacherNoise
from mcmj.learning.teaching import held_outputs, synchronise
from mcmj.metrics.orbits import orbit_error
from mcmj.targets.limit_cycles import from_array, target
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.seeds import stream

BRIEF = Teaching(duration=6.0, washout=2.0)
STEP = 2e-3


@pytest.fixture(scope="module")
def goal():
    return target("quadratic")


def taught(body, goal, settings=BRIEF, seed=0, **options):
    simulation = Simulation(body, timestep=STEP, **options)
    return teach(simulation, goal, settings, seed), simulation


@pytest.mark.parametrize("bias", [False, True])
@pytest.mark.parametrize("ridge", [0.0, 1e-6])
def test_fit_is_the_regression_of_the_clean_target_on_the_driven_lengths(body, goal, bias, ridge):
    """Done again with the twin, the noise stream and NumPy; NRMSE by its definition."""
    settings = Teaching(duration=3.0, washout=1.0, noise=0.1, ridge_per_row=ridge, bias=bias)
    fit, _ = taught(body, goal, settings, seed=3, integrator="Euler")
    steps, washout = 1500, 500
    clean = goal.sample(STEP * np.arange(steps))
    noisy = clean + 0.1 * stream(3, "teacher_noise").standard_normal(clean.shape)
    lengths = twins.run(body, steps, timestep=STEP, offset=noisy).lengths[washout:]
    wanted = clean[washout:]
    w = fit_readout(lengths, wanted, ridge * len(wanted), bias=bias)
    n = body.n_springs
    predicted, again = (lengths @ v[:n] + v[n:].sum(axis=0) for v in (fit.w_out, w))
    spread = np.sqrt(((wanted - wanted.mean(axis=0)) ** 2).mean(axis=0).sum())
    assert np.abs(predicted - again).max() < 1e-6
    nrmse = np.sqrt(((predicted - wanted) ** 2).sum(axis=1).mean()) / spread
    assert fit.train_nrmse == pytest.approx(nrmse, rel=1e-6)
    assert fit.rows == steps - washout
    assert fit.w_out.shape == (n + bias, 2)


def test_some_outputs_may_be_fed_back_without_noise(body, goal):
    """As by hand, with the noise stream; and the wrong number of shares is named."""
    settings = Teaching(duration=3.0, washout=1.0, noise=0.1)
    course = teaching.Course(Simulation(body, timestep=STEP), settings, 3)
    course.attend(Lesson(goal.sample, 3.0, 1.0, noise_share=(1.0, 0.0)))
    clean = goal.sample(STEP * np.arange(1500))
    noisy = clean.copy()
    noisy[:, 0] += 0.1 * stream(3, "teacher_noise").standard_normal(1500)
    run = Simulation(body, timestep=STEP).rollout(offset=noisy)
    w = fit_readout(run.lengths[500:], clean[500:], 1e-6 * 1000)
    assert np.abs(course.regression.solve(ridge=1e-6 * 1000).w_out - w).max() < 1e-9
    for share in ((1.0, 0.0, 1.0), (-1.0, 0.0)):
        with pytest.raises(InvalidArgumentError, match="noise_share: expected"):
            course.attend(Lesson(goal.sample, 3.0, noise_share=share))


def test_slow_noise_is_an_ornstein_uhlenbeck_process():
    """Its variance, and its correlation exp(-t / drift_time), from many parts of a long run."""
    settings = Teaching(noise=0.0, drift=0.3, drift_time=0.5)
    noise = TeacherNoise(settings, np.random.default_rng(0), 2, STEP)
    values = np.concatenate([noise.take(steps) for steps in (1, 700, 400_000)])
    assert values.std() == pytest.approx(0.3, rel=0.05)
    for lag in (0.25, 0.5, 1.0):
        k = round(lag / STEP)
        correlation = (values[k:] * values[:-k]).mean() / values.var()
        assert correlation == pytest.approx(np.exp(-lag / 0.5), abs=0.05)


def test_runs_from_where_constants_held_the_body_are_weighted_rows(body, goal):
    """As by hand: HELD seconds of each constant, which are not learnt, then the target."""
    settings = replace(BRIEF, noise=0.0, held_runs=2, away_duration=1.0, away_weight=0.1)
    fit, _ = taught(body, goal, settings)
    plain, rows = Simulation(body, timestep=STEP), []
    held = held_outputs(goal, 2)
    assert (np.abs(held) < 1.5 * np.abs(goal.orbit(4096)).max(axis=0)).all()
    for outputs, seconds, skipped, weight in ((held[0], 11, 10, 0.1), (held[1], 11, 10, 0.1),
                                              (None, 6, 2, 1.0)):  # fmt: skip
        first = round(plain.time / STEP)
        clean = goal.sample(STEP * np.arange(first, first + round(seconds / STEP)))
        fed, kept = clean.copy(), slice(round(skipped / STEP), None)
        if outputs is not None:
            fed[: kept.start] = outputs
        lengths = plain.rollout(offset=fed, gate=0.0).lengths
        rows.append(np.sqrt(weight) * np.hstack([lengths, clean])[kept])
    x, y = np.split(np.vstack(rows), [body.n_springs], axis=1)
    w = np.linalg.lstsq(x, y)[0]
    assert np.abs(x @ (fit.w_out - w)).max() < 1e-7


def test_same_seed_same_bits(body, goal):
    one, _ = taught(body, goal)
    two, _ = taught(body, goal)
    assert one.w_out.tobytes() == two.w_out.tobytes()
    assert one.train_nrmse == two.train_nrmse


def test_another_seed_and_no_noise_differ(body, goal):
    base, _ = taught(body, goal)
    other, _ = taught(body, goal, seed=1)
    silent, _ = taught(body, goal, Teaching(duration=6.0, washout=2.0, noise=0.0))
    silent_too, _ = taught(body, goal, Teaching(duration=6.0, washout=2.0, noise=0.0), seed=1)
    assert not np.allclose(base.w_out, other.w_out, rtol=1e-3)
    assert not np.allclose(base.w_out, silent.w_out, rtol=1e-3)
    assert silent.w_out.tobytes() == silent_too.w_out.tobytes()


def test_length_noise_acts_like_ridge(body, goal):
    """Both shrink the weights that live on tiny lengths."""

    def size(**noise):
        settings = Teaching(duration=6.0, washout=2.0, **noise)
        return np.linalg.norm(taught(body, goal, settings)[0].w_out)

    free, noisy, ridge = size(), size(length_noise=1e-3), size(ridge_per_row=1e-6)
    assert noisy < 0.5 * free
    assert ridge == pytest.approx(noisy, rel=0.1)


@pytest.mark.parametrize("chunk", [701, 5000])
def test_chunks_do_not_change_the_result(body, goal, monkeypatch, chunk):
    """The noise, the motion and, to rounding, the fit are the same in chunks of any size."""
    whole, one = taught(body, goal)
    monkeypatch.setattr(teaching, "CHUNK", chunk)
    chunked, two = taught(body, goal)
    assert one.state.positions.tobytes() == two.state.positions.tobytes()
    assert chunked.rows == whole.rows
    assert chunked.train_nrmse == pytest.approx(whole.train_nrmse, rel=1e-8)
    assert np.abs(chunked.w_out - whole.w_out).max() < 1e-7 * np.abs(whole.w_out).max()


def test_memory_does_not_grow_with_duration(oscillator, monkeypatch):
    monkeypatch.setattr(teaching, "CHUNK", 1000)
    body = mcmj.Body(**_arrays(oscillator) | {"w_fb": [[0.0, 0.0], [1.0, 0.5]]})
    goal = target("lissajous")

    def peak(duration):
        simulation = Simulation(body)
        tracemalloc.start()
        try:
            teach(simulation, goal, Teaching(duration=duration, washout=0.0), 0)
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    peak(2.0)
    assert peak(24.0) < 1.3 * peak(3.0)


def _arrays(body):
    return {name: getattr(body, name) for name in body.__dataclass_fields__}


def test_progress_counts_every_step(body, goal):
    seen = []
    simulation = Simulation(body, timestep=STEP)
    teach(simulation, goal, BRIEF, 0, on_steps=seen.append)
    assert sum(seen) == 3000


def test_the_simulation_goes_on_with_the_fitted_readout(body, goal):
    fit, simulation = taught(body, goal)
    assert np.array_equal(simulation.w_out, fit.w_out)
    assert simulation.time == pytest.approx(6.0, abs=1e-12)
    run = simulation.rollout(10)
    assert run.outputs == pytest.approx(run.lengths @ fit.w_out, rel=1e-9)


def test_free_run_stays_near_the_target():
    """A small body, ten seconds of teaching, three periods by itself."""
    body, goal = mcmj.random_body(0, nodes=20), target("quadratic")
    fit, simulation = taught(body, goal, Teaching(duration=30.0, washout=10.0))
    start = simulation.time
    run = simulation.rollout(round(3 * goal.period / STEP), record=("outputs",))
    assert fit.train_nrmse < 0.05
    assert orbit_error(run.outputs, goal) < 0.05
    wanted = goal.sample(run.times)
    assert run.times[0] == pytest.approx(start)
    assert np.abs(run.outputs[:500] - wanted[:500]).max() < 0.1 * np.ptp(wanted)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["van_der_pol", "quadratic", "lissajous"])
def test_default_teaching_of_a_default_body(name):
    body, goal = mcmj.random_body(0), target(name)
    simulation = Simulation(body)
    teach(simulation, goal, Teaching(), 0)
    simulation.rollout(40_000, record=())
    outputs = simulation.rollout(20_000, record=("outputs",)).outputs
    assert orbit_error(outputs, goal) < 0.05


def test_synchronise_is_clean_teacher_forcing(body, goal):
    simulation = Simulation(body, timestep=STEP)
    simulation.rollout(100)
    synchronise(simulation, goal, 1.0)
    offset = np.vstack([np.zeros((100, 2)), goal.sample(STEP * np.arange(100, 600))])
    twin = Simulation(body, timestep=STEP)
    twin.rollout(offset=offset)
    assert simulation.time == pytest.approx(1.2, abs=1e-12)
    assert np.abs(simulation.state.positions - twin.state.positions).max() < 1e-13


def test_one_output(oscillator):
    """A target of one dimension on a body with one channel."""
    body = mcmj.Body(**_arrays(oscillator) | {"w_fb": [[0.0], [1.0]]})
    goal = from_array("sine", np.sin(2 * np.pi * np.arange(64)[:, None] / 64), 0.05)
    fit, _ = taught(body, goal, Teaching(duration=8.0, washout=2.0, bias=True))
    assert fit.w_out.shape == (2, 1)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("duration", 0.0),
        ("washout", -1.0),
        ("washout", 121.0),
        ("washout", 120.0),
        ("noise", -0.1),
        ("length_noise", np.nan),
        ("ridge_per_row", -1e-9),
    ],
)
def test_bad_settings_are_named(name, value):
    with pytest.raises(InvalidArgumentError) as caught:
        Teaching(**{name: value})
    assert caught.value.name == name


def test_a_target_of_another_dimension_is_refused(body):
    goal = from_array("sine", np.sin(2 * np.pi * np.arange(64)[:, None] / 64), 0.05)
    with pytest.raises(InvalidArgumentError, match="expected 1 feedback channels for sine"):
        teach(Simulation(body), goal, BRIEF, 0)
