"""Multipliers, exponents and blows in cases that are known, and of a small taught body."""

import numpy as np
import pytest
from scipy.integrate import quad

import mcmj
from mcmj.analysis.loops.loop_map import advance
from mcmj.analysis.stability.basin import kicked, on_cycle, pushed, scaled_starts, survey
from mcmj.analysis.stability.confirm import directional, ensemble_map
from mcmj.analysis.stability.cycle import find_cycle, flow_map, weights_at
from mcmj.analysis.stability.floquet import (
    differences,
    floquet,
    jacobian,
    multipliers,
    target_multipliers,
)
from mcmj.analysis.stability.loop import ClosedLoop
from mcmj.analysis.stability.lyapunov import lyapunov_exponent
from mcmj.analysis.stability.variational import step_jacobian, variational
from mcmj.experiments.certify import run as certify
from mcmj.experiments.certify.config import Config
from mcmj.utils.errors import InvalidArgumentError, McmjError


def cross(damping):
    """One mass between four anchors: x'' = -2 k x - 2 d x' in each direction for itself."""
    x_springs, y_springs = (4.0, 4.0), (9.0, 9.0)
    return mcmj.Body(
        positions=[[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1]],
        springs=[[0, 1], [0, 2], [0, 3], [0, 4]],
        k1=[*x_springs, *y_springs],
        k3=[0.0] * 4,
        d1=[damping] * 4,
        d3=[0.0] * 4,
        fixed=[False, True, True, True, True],
    )


# --- the target systems ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "divergence"),
    [
        ("van_der_pol", lambda x: 1 - x[0] ** 2),
        ("quadratic", lambda x: 2 - 7 * (3 * x[0] ** 2 + x[1] ** 2) - x[0] ** 2 - 3 * x[1] ** 2),
    ],
)
def test_multipliers_of_a_planar_system_are_1_and_its_integrated_divergence(name, divergence):
    goal = mcmj.target(name)
    values = target_multipliers(goal)
    area, _ = quad(lambda t: divergence(goal.sample([t])[0]), 0, goal.period, limit=400)
    assert abs(values[0] - 1) < 1e-7
    assert abs(values[1] - np.exp(area)) < 1e-6 * max(1e-2, np.exp(area))


def test_van_der_pol_has_the_exponent_of_the_literature():
    goal = mcmj.target("van_der_pol")
    exponent = np.log(abs(target_multipliers(goal)[1])) / goal.period
    assert exponent == pytest.approx(-1.0593, abs=1e-3)  # mu = 1, period 6.6633


def test_a_curve_without_a_system_has_no_multipliers():
    with pytest.raises(InvalidArgumentError, match="system"):
        target_multipliers(mcmj.target("lissajous"))


def test_jacobian_is_exact_for_cubics():
    x = np.array([0.3, -1.2])
    found = jacobian(lambda t, x: np.array([x[0] ** 3 * 2, x[0] * x[1] ** 2]), x)
    expected = [[6 * x[0] ** 2, 0.0], [x[1] ** 2, 2 * x[0] * x[1]]]
    np.testing.assert_allclose(found, expected, atol=1e-10)


# --- linear bodies ---------------------------------------------------------------------------


def test_linear_oscillator_has_the_multipliers_of_its_step_map():
    """v+ = v - h (2 k q + 2 d v), q+ = q + h v+, over a whole number of steps."""
    body, h, d, steps = cross(0.3), 1e-3, 0.3, 700
    loop = ClosedLoop(body, None, timestep=h)
    rest = np.zeros(4)
    maps = []
    for k in (4.0, 9.0):
        row = [-2 * h * k, 1 - 2 * h * d]
        maps.append(np.linalg.matrix_power([[1 + h * row[0], h * row[1]], row], steps))
    expected = np.sort_complex(np.concatenate([np.linalg.eigvals(m) for m in maps]))
    eps = 1e-6
    nudges = eps * np.eye(4)
    ends = flow_map(loop, np.vstack([rest + nudges, rest - nudges]), (steps + 1e-9) * h)
    numeric = np.linalg.eigvals(((ends[:4] - ends[4:]) / (2 * eps)).T)
    _, exact = variational(loop, rest, (steps + 1e-9) * h)
    np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(exact)), expected, atol=1e-7)
    np.testing.assert_allclose(np.sort_complex(numeric), expected, atol=1e-6)


def test_exponent_of_a_damped_oscillator_is_its_real_part():
    loop = ClosedLoop(cross(0.3), None)
    found = lyapunov_exponent(loop, np.zeros(4), interval=1.0, intervals=60)
    assert found.value == pytest.approx(-0.3, abs=3e-3)  # x'' = -8 x - 0.6 x'
    assert found.spread < 1e-2


def test_exponent_of_an_overdamped_oscillator():
    loop = ClosedLoop(cross(6.0), None)
    found = lyapunov_exponent(loop, np.zeros(4), interval=1.0, intervals=20, transient=20)
    assert found.value == pytest.approx(-6 + np.sqrt(36 - 8), rel=2e-3)


# --- the step map of any body ----------------------------------------------------------------


@pytest.mark.parametrize("closed", [False, True])
def test_step_map_is_linearised_as_it_is_stepped(body, w_bias, closed):
    loop = ClosedLoop(body, w_bias if closed else None)
    rng = np.random.default_rng(0)
    state = loop.vector(mcmj.Simulation(body).state) + 0.1 * rng.standard_normal(loop.size)
    analytic, eps = step_jacobian(loop, state), 1e-5
    nudges = eps * np.eye(loop.size)
    ends = advance(loop, np.vstack([state + nudges, state - nudges]), 1)
    numeric = ((ends[: loop.size] - ends[loop.size :]) / (2 * eps)).T
    np.testing.assert_allclose(numeric, analytic, atol=1e-8)


def test_states_and_outputs_go_through_the_nodes(body, w_bias):
    loop = ClosedLoop(body, w_bias)
    states = np.random.default_rng(0).standard_normal((3, loop.size))
    positions, velocities = loop.nodes(states)
    again = loop.vector(mcmj.core.trajectory.State(positions[1], velocities[1]))
    np.testing.assert_array_equal(again, states[1])
    assert (positions[:, body.fixed] == body.positions[body.fixed]).all()
    run = loop.run(states, 1)
    np.testing.assert_allclose(loop.outputs(states), run.outputs[:, 0], rtol=1e-10)


def test_flow_map_agrees_between_steps(body, w_out):
    """Interpolated states of a step of 1 ms against those on the grid of another multiple."""
    loop = ClosedLoop(body, w_out)
    start = loop.vector(mcmj.Simulation(body).state)[None]
    start = advance(loop, start, 300)
    early, late = flow_map(loop, start, 0.1), flow_map(loop, start, 0.101)
    middle = flow_map(loop, start, 0.1005)
    assert np.abs(middle - (early + late) / 2).max() < 0.1 * np.abs(late - early).max()
    np.testing.assert_allclose(flow_map(loop, start, 0.1), advance(loop, start, 100), atol=1e-9)
    in_mujoco = ensemble_map(loop, start, 0.1005)
    np.testing.assert_allclose(in_mujoco, middle, atol=1e-9)


@pytest.mark.parametrize("fraction", [0.0, 0.3, 1.0])
def test_interpolation_between_steps_is_exact_for_cubics(fraction):
    nodes = np.array([-1.0, 0.0, 1.0, 2.0])
    for power in range(4):
        value = weights_at(fraction) @ nodes**power
        assert value == pytest.approx(fraction**power, abs=1e-14)


# --- a taught body ---------------------------------------------------------------------------


@pytest.mark.slow
def test_two_methods_and_mujoco_agree_on_a_stable_cycle(taught_loop):
    loop, cycle, _ = taught_loop
    found = floquet(loop, cycle)
    assert cycle.residual < 1e-6
    assert found.disagreement < 1e-5
    assert abs(found.multipliers[0] - 1) < 1e-4
    assert found.phase_error < 1e-3
    assert found.leading_nontrivial < 0.9
    unit = cycle.tangent / np.linalg.norm(cycle.tangent)
    moved = directional(loop, cycle.state, unit[None], cycle.period, 1e-4)[0]
    assert np.linalg.norm(moved - unit) < 1e-3


@pytest.mark.slow
def test_multipliers_do_not_hang_on_the_width_of_differences(taught_loop):
    loop, cycle, _ = taught_loop
    sets = [multipliers(differences(loop, cycle, eps))[0][:2] for eps in (3e-4, 1e-4, 3e-5)]
    np.testing.assert_allclose(sets[0], sets[1], atol=1e-4)
    np.testing.assert_allclose(sets[2], sets[1], atol=1e-4)


@pytest.mark.slow
def test_exponent_of_a_cycle_is_zero(taught_loop):
    loop, cycle, _ = taught_loop
    found = lyapunov_exponent(loop, cycle.state, interval=cycle.period, scale=cycle.scale)
    assert abs(found.value) < 1e-3


@pytest.mark.slow
def test_small_blows_are_recovered_from_and_huge_ones_are_not(taught_loop):
    loop, cycle, goal = taught_loop
    states = on_cycle(loop, cycle, 4)
    weak = kicked(loop, cycle, np.full(4, 0.1), np.random.default_rng(0))
    assert survey(loop, goal, weak, duration=30.0).fraction == 1.0
    far = scaled_starts(loop, goal, np.ones(4), np.arange(4) / 4, duration=20.0)
    assert survey(loop, goal, far, duration=30.0).times.max() < 5.0
    after = pushed(loop, states, np.full((4, loop.body.n_nodes), 1e7), 1.0)
    lost = survey(loop, goal, after, duration=30.0)
    assert lost.blown.all()
    assert np.isinf(lost.times).all()


# --- the certificate -------------------------------------------------------------------------

BRIEF = Config(
    task="quadratic", body="quadratic", free_run=25.0, window=20.0, recovery=25.0,
    scales=(0.5, 1.0), phases=2, kicks=(0.5,), pushes=(1.0,), copies=4, refine=2,
)  # fmt: skip


@pytest.mark.slow
def test_a_certificate_is_complete_and_its_numbers_are_those_of_its_parts():
    stages = []
    result = certify.run(BRIEF, on_steps=stages.append)
    assert sum(stages) == len(certify.STAGES)
    table = result.metrics
    assert table["basin_fraction"] == 1.0
    assert table["rest_recovers"]
    assert table["floquet_disagreement"] < 1e-5
    assert table["mujoco_monodromy_error"] < 1e-5
    assert table["leading_nontrivial"] < 0.2
    assert table["mujoco_pushes_agreeing"] == [1, 1]
    assert len(table["force_tolerance_by_copy"]) == BRIEF.copies
    assert 0 < table["force_tolerance_least"] <= table["force_tolerance"]
    assert 0 < table["phase_jitter_standard_error"] < 0.1 * table["phase_jitter_per_period"]
    assert result.starts.times.shape == (4,)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("window", 2.0),
        ("recovery", 10.0),
        ("kicks", ()),
        ("pushes", (-1.0,)),
        ("scales", (0.0, 1.0)),
        ("seed", -1),
        ("threshold", 0.0),
    ],
)
def test_wrong_certificates_are_refused_before_anything_runs(name, value):
    with pytest.raises(InvalidArgumentError, match=name):
        Config(**{name: value})


def test_a_loop_that_rests_has_no_cycle(body):
    loop = ClosedLoop(body, np.zeros((body.n_springs, 2)))
    start = loop.vector(mcmj.Simulation(body).state)
    with pytest.raises(McmjError):
        find_cycle(loop, start, 1.0, settle=1.0, rounds=1)
