"""Hard cases end in a finite trajectory or in a DivergenceError that says what to do."""

import math
import re

import numpy as np
import pytest
from networks import simulation

import mcmj
from mcmj.core.integrators import INTEGRATORS
from mcmj.core.trajectory import State
from mcmj.experiments.hard_cases.bodies import CASES
from mcmj.experiments.hard_cases.run import (
    Config,
    amplitudes_of,
    bisect,
    exact_motion,
    noise,
    run,
    simulate,
)
from mcmj.reference.integration import METHODS
from mcmj.simulation.stepsize.limit import stability_limit
from mcmj.utils.errors import DivergenceError

TWINS = [name for name in METHODS if name != "dop853"]
STEPS = 400


@pytest.fixture(autouse=True)
def silence(tmp_path, monkeypatch, capfd):
    """Nothing on stdout or stderr, and no MUJOCO_LOG.TXT."""
    monkeypatch.chdir(tmp_path)
    yield
    assert capfd.readouterr() == ("", "")
    assert not list(tmp_path.iterdir())


def by_mujoco(case, integrator, step, steps=STEPS, positions=None, **options):
    sim = simulation(case.body, integrator, step, case.w_out, **options)
    sim.set_state(positions=positions, velocities=case.velocities)
    return sim.rollout(steps, forces=case.forces)


def by_twin(case, method, step, steps=STEPS, positions=None, **options):
    start = State(case.body.positions if positions is None else positions, case.velocities)
    return mcmj.reference.integrate(
        case.body, method=method, steps=steps, timestep=step, forces=case.forces,
        w_out=case.w_out, initial_state=start, **options,
    )  # fmt: skip


def assert_finite_or_explained(rollout, name, step, steps=STEPS, *, names_node):
    run, error = outcome(rollout)
    if error is not None:
        message = str(error)
        assert re.search(r"t = [\d.e+-]+ s", message)
        assert name in message
        assert f"step {1e3 * step:g} ms" in message
        assert "try a smaller step" in message
        assert not names_node or re.search(r"node \d+", message)
        assert 0 <= error.steps_done < steps
        assert math.isfinite(error.time)
        return
    for array in (run.lengths, run.outputs, run.final_state.positions, run.final_state.velocities):
        assert np.isfinite(array).all()
    assert len(run) == steps


@np.errstate(over="ignore")  # see test_speeds_whose_squares_overflow
def outcome(rollout):
    """A trajectory and None, or None and the error."""
    try:
        return rollout(), None
    except DivergenceError as error:
        return None, error


@pytest.mark.parametrize("step", [1e-3, 0.05])
@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("name", CASES)
def test_mujoco_ends_well(name, integrator, step):
    case = CASES[name](0)
    assert_finite_or_explained(
        lambda: by_mujoco(case, integrator, step), f"integrator {integrator}", step, names_node=True
    )


@pytest.mark.parametrize("step", [1e-3, 0.05])
@pytest.mark.parametrize("method", TWINS)
@pytest.mark.parametrize("name", CASES)
def test_the_twins_end_well(name, method, step):
    case = CASES[name](0)
    assert_finite_or_explained(
        lambda: by_twin(case, method, step), f"method {method}", step, names_node=False
    )


@pytest.mark.parametrize("springs", ["cubic", "tansig"])
@pytest.mark.parametrize("name", ["stiff_springs", "stiff_dampers", "fast_start", "large_forces"])
def test_callback_springs_end_well(name, springs):
    case = CASES[name](0)
    for integrator in ("Euler", "RK4", "discrete"):
        assert_finite_or_explained(
            lambda i=integrator: by_mujoco(case, i, 1e-3, springs=springs),
            f"integrator {integrator}",
            1e-3,
            names_node=True,
        )


@pytest.mark.parametrize("name", CASES)
def test_fine_steps_agree_with_dop853(name):
    """200 steps of 1/16 of the safe step, in which no spring turns by more than 1/8."""
    case = CASES[name](0)
    x1, x2 = amplitudes_of(case.body, exact_motion(case, 0.01))
    safe = stability_limit(case.body, "RK4", elongation=x1, speed=x2, w_out=case.w_out)
    turn = np.ptp(case.velocities) / mcmj.core.body.spring_lengths(
        case.body.positions, case.body.springs
    ).min()  # fmt: skip
    step = min(1e-3, safe / 16, 1 / (8 * turn + 1e-9))
    exact = by_twin(case, "dop853", step, 200, rtol=1e-10).lengths
    moved = np.abs(exact - exact[0]).max()
    for lengths in (
        by_mujoco(case, "RK4", step, 200).lengths,
        by_twin(case, "rk4", step, 200).lengths,
    ):
        assert np.abs(lengths - exact).max() < 1e-3 * moved
    for lengths in (
        by_mujoco(case, "Euler", step, 200).lengths,
        by_mujoco(case, "discrete", step, 200).lengths,
        by_twin(case, "semi_implicit_euler", step, 200).lengths,
    ):
        assert np.abs(lengths - exact).max() < 0.1 * moved


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_coincident_nodes(integrator):
    """A spring of length 0 has no direction."""
    case = CASES["ordinary"](0)
    where = case.body.positions.copy()
    tail, head = next(ends for ends in case.body.springs if not case.body.fixed[ends].any())
    where[tail] = where[head]
    assert_finite_or_explained(
        lambda: by_mujoco(case, integrator, 1e-3, positions=where),
        f"integrator {integrator}",
        1e-3,
        names_node=True,
    )


@pytest.mark.parametrize("method", TWINS)
def test_coincident_nodes_in_the_twins(method):
    case = CASES["ordinary"](0)
    where = case.body.positions.copy()
    tail, head = next(ends for ends in case.body.springs if not case.body.fixed[ends].any())
    where[tail] = where[head]
    assert_finite_or_explained(
        lambda: by_twin(case, method, 1e-3, positions=where),
        f"method {method}",
        1e-3,
        names_node=False,
    )


@pytest.mark.parametrize("gain", [1e5, 1e9, 1e150])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_absurd_gains(integrator, gain):
    case = CASES["unstable_loop"](0)
    loop = type(case)(case.body, case.velocities, case.forces, gain * case.w_out)
    assert_finite_or_explained(
        lambda: by_mujoco(loop, integrator, 1e-3), f"integrator {integrator}", 1e-3, names_node=True
    )


def test_speeds_whose_squares_overflow():
    """The error is a DivergenceError, not NumPy's RuntimeWarning."""
    case = CASES["unstable_loop"](0)
    loop = type(case)(case.body, case.velocities, case.forces, 1e9 * case.w_out)
    with pytest.raises(DivergenceError):
        by_mujoco(loop, "RK4", 1e-3)


def test_the_remedies_named_by_an_error_work():
    case = CASES["stiff_dampers"](0)
    with pytest.raises(DivergenceError, match="'discrete' survives stiff dampers"):
        by_mujoco(case, "Euler", 1e-3)
    assert np.isfinite(by_mujoco(case, "discrete", 1e-3).lengths).all()


def test_the_error_says_the_last_good_step():
    case = CASES["stiff_dampers"](0)
    with pytest.raises(DivergenceError) as caught:
        by_mujoco(case, "Euler", 1e-3)
    good = caught.value.steps_done
    assert caught.value.time == pytest.approx(good * 1e-3)
    assert np.isfinite(by_mujoco(case, "Euler", 1e-3, max(good, 1)).lengths).all()


def test_a_simulation_lives_on_after_a_reset():
    case = CASES["stiff_dampers"](0)
    sim = mcmj.Simulation(case.body)
    sim.set_state(velocities=case.velocities)
    with pytest.raises(DivergenceError):
        sim.rollout(STEPS)
    sim.reset()
    quiet = sim.rollout(STEPS).lengths
    np.testing.assert_array_equal(quiet, np.tile(quiet[0], (STEPS, 1)))


def test_bisection():
    for edge in (1e-7, 3e-3, 0.3):
        assert bisect(lambda h, e=edge: h <= e, 0.01, 0.01) == pytest.approx(edge, rel=0.011)
    assert bisect(lambda h: h <= 0.3, 0.01, 0.01, 0.2) == math.inf
    assert bisect(lambda h: True, 0.01, 0.01) == math.inf
    assert bisect(lambda h: False, 0.01, 0.01) == 0.0


def test_noise_is_what_turns_at_every_step():
    steps = np.arange(200)[:, None]
    smooth = 1.0 + 0.1 * np.sin(0.05 * steps)
    flicker = 1e-3 * (-1.0) ** steps
    assert noise(smooth) < 1e-5
    assert noise(smooth + flicker) == pytest.approx(1e-3, rel=0.02)
    assert noise(smooth + flicker * (steps < 8)) < 1e-5  # over at once


def test_experiment():
    config = Config(cases=("ordinary",), integrators=("Euler", "discrete"), precision=0.1)
    result = run(config)
    euler, discrete = result.rows
    assert euler.bracketed
    assert euler.low < euler.measured < euler.high < euler.at_rest
    assert discrete.measured == math.inf
    assert result.metrics["ordinary"]["Euler"]["measured_ms"] == 1e3 * euler.measured
    lengths = simulate(CASES["ordinary"](0), "Euler", euler.measured, 100)
    assert np.isfinite(lengths).all()


EXPLICIT = tuple(name for name, row in INTEGRATORS.items() if not row.implicit)


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_the_bracket_holds_the_measured_limit(name):
    for row in run(Config(cases=(name,), integrators=EXPLICIT)).rows:
        assert row.bracketed, row
        assert row.high == pytest.approx(2 * row.low)


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_other_seeds_and_steps(name):
    for seed in range(1, 6):
        case = CASES[name](seed)
        for step in (1e-4, 3e-3, 1.0):
            for integrator in INTEGRATORS:
                assert_finite_or_explained(
                    lambda c=case, i=integrator, h=step: by_mujoco(c, i, h),
                    f"integrator {integrator}", step, names_node=True,
                )  # fmt: skip
            for method in TWINS:
                assert_finite_or_explained(
                    lambda c=case, m=method, h=step: by_twin(c, m, h),
                    f"method {method}", step, names_node=False,
                )  # fmt: skip


@pytest.mark.slow
def test_a_million_steps():
    case = CASES["unstable_loop"](0)
    sim = mcmj.Simulation(case.body, w_out=case.w_out, timestep=1e-4, integrator="discrete")
    sim.set_state(velocities=case.velocities)
    for part in sim.stream(1_000_000, record=("lengths",)):
        assert np.isfinite(part.lengths).all()
    assert sim.time == pytest.approx(100.0)
