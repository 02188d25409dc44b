"""Multipliers and basins of any reservoir: known systems, rotated copies, the twin of a body."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

import mcmj
from mcmj.analysis.loops.loop_map import advance
from mcmj.analysis.loops.reservoir_loop import ReservoirLoop
from mcmj.analysis.stability.basin import kicked, on_cycle, pushed, survey
from mcmj.analysis.stability.confirm import directional
from mcmj.analysis.stability.cycle import Cycle, find_cycle
from mcmj.analysis.stability.floquet import (
    differences,
    floquet,
    multipliers_of,
    target_multipliers,
)
from mcmj.analysis.stability.loop import ClosedLoop
from mcmj.analysis.stability.lyapunov import lyapunov_exponent
from mcmj.analysis.stability.phase import phase_diffusion
from mcmj.analysis.stability.tolerance import Trial, force_tolerance
from mcmj.analysis.stability.variational import variational
from mcmj.metrics.orbits import orbit_error
from mcmj.targets.limit_cycles import limit_cycle
from mcmj.utils.errors import DivergenceError, InvalidArgumentError, McmjError, UnknownNameError

RAYLEIGH = """<mujoco><option timestep="{h}" integrator="RK4" gravity="0 0 0"/><worldbody><body>
<joint name="x" type="slide" axis="1 0 0" stiffness="1" damping="0 0 .333333333333"/>
<geom size=".1" mass="1"/></body></worldbody><actuator><motor name="m" joint="x"/></actuator>
</mujoco>"""
SWIMMER = """<mujoco><option timestep="2e-3" integrator="RK4" gravity="0 0 0" density="1000"
viscosity="1e-3"/><default><geom type="ellipsoid" density="1000"/></default><worldbody>
<body pos="{pos}" quat="{quat}"><freejoint name="root"/><geom size=".12 .03 .06"/>
 <body pos=".2 0 0"><joint name="a" axis="0 0 1" pos="-.1 0 0" stiffness=".4" damping="0 0 .01"/>
 <geom size=".1 .02 .05"/>
  <body pos=".2 0 0"><joint name="b" axis="0 .3 1" pos="-.1 0 0" stiffness=".15" damping=".02"/>
  <geom size=".1 .01 .05"/></body></body></body></worldbody>
<actuator><motor name="m" joint="a"/></actuator></mujoco>"""
BOX = """<mujoco><option timestep="1e-3" cone="elliptic" iterations="100" tolerance="1e-12"/>
<worldbody><geom type="plane" size="5 5 .1"/><body pos="{pos}" quat="{quat}">
<freejoint name="root"/><geom type="box" size=".2 .15 .1" density="200"/><body pos="0 0 .2">
<joint name="a" type="slide" axis=".3 0 1" stiffness="20" damping="0 0 .4"/>
<geom size=".05" mass=".3" contype="0" conaffinity="0"/></body></body></worldbody>
<actuator><motor name="m" joint="a"/></actuator></mujoco>"""


# --- known systems ---------------------------------------------------------------------------


def at_rest(loop, duration):
    """The state of rest, as a cycle of any period."""
    return Cycle(np.zeros(loop.size), np.ones(loop.size), duration, np.ones(loop.size), 0.0)


def test_a_linear_loop_has_the_multipliers_of_its_matrix():
    """Two coupled sliders, feedback from both positions and speeds; RK4 but for the held force."""
    xml = """<mujoco><option timestep="{h}" integrator="RK4" gravity="0 0 0"/><worldbody>
    <body><joint name="p" type="slide" axis="1 0 0" stiffness="3" damping=".4"/>
    <geom size=".1" mass="2" conaffinity="0"/></body>
    <body><joint name="q" type="slide" axis="1 0 0" stiffness="1" damping=".1"/>
    <geom size=".1" mass="1" conaffinity="0"/></body></worldbody>
    <tendon><fixed name="t" stiffness="5" springlength="0"><joint joint="p" coef="1"/>
    <joint joint="q" coef="-1"/></fixed></tendon>
    <actuator><motor name="m" joint="q"/></actuator></mujoco>"""
    w = np.array([0.3, -0.2, 0.1, -0.5])
    mass = np.diag([2.0, 1.0])
    force = np.array([[-8.0, 5.0, -0.4, 0.0], [5.0, -6.0, 0.0, -0.1]])
    force[1] += w
    matrix = np.vstack([np.eye(4)[2:], np.linalg.solve(mass, force)])
    wanted = np.sort_complex(np.linalg.eigvals(expm(matrix)))
    found = []
    for h in (2e-3, 1e-3):
        reservoir = mcmj.Reservoir(
            xml.format(h=h), sensors=["jointpos:*", "jointvel:*"], channels=["m"],
            w_out=w[:, None],
        )  # fmt: skip
        loop = ReservoirLoop(reservoir)
        assert loop.left_out == ()
        monodromy = differences(loop, at_rest(loop, 1.0))
        found.append(np.sort_complex(np.linalg.eigvals(monodromy)))
    np.testing.assert_allclose(2 * found[1] - found[0], wanted, atol=3e-7)  # in the step: order 1
    exponent = lyapunov_exponent(loop, loop.rest, interval=1.0)
    assert exponent.value == pytest.approx(np.linalg.eigvals(matrix).real.max(), abs=1e-2)


@pytest.fixture(scope="module")
def rayleigh():
    """x'' + x = x' - x'^3 / 3 with the x' fed back: Van der Pol's cycle, at 1 ms."""
    reservoir = mcmj.Reservoir(
        RAYLEIGH.format(h=1e-3), sensors=["jointpos:x", "jointvel:x"],
        channels={"x": {"m": 0.0}, "v": {"m": 1.0}}, w_out=np.eye(2),
    )  # fmt: skip
    reservoir.set_state(qpos=[1.0])
    reservoir.rollout(20_000, record=())
    loop = ReservoirLoop(reservoir)
    return reservoir, loop, find_cycle(loop, loop.now, 6.6, settle=20.0)


def test_van_der_pols_multipliers_in_mujoco(rayleigh):
    _, loop, cycle = rayleigh
    goal = mcmj.target("van_der_pol")
    found = multipliers_of(loop, cycle)
    assert cycle.period == pytest.approx(goal.period, rel=3e-4)  # of first order in the step
    assert abs(found.multipliers[0] - 1) < 2e-8
    assert found.phase_error < 1e-6
    assert found.leading_nontrivial == pytest.approx(abs(target_multipliers(goal)[1]), rel=3e-3)
    assert found.neutral == 1
    assert found.transverse.tolist() == [found.multipliers[1]]


def test_a_survey_agrees_with_separate_rollouts(rayleigh):
    reservoir, loop, cycle = rayleigh
    goal = limit_cycle(
        "rayleigh", lambda t, x: np.array([x[1], x[1] - x[1] ** 3 / 3 - x[0]]), [1.0, 0.0]
    )
    hit = kicked(loop, cycle, np.array([0.5, 3.0]), np.random.default_rng(0))
    states = np.vstack([hit, loop.rest, [0.0, 1e6]])
    found = survey(loop, goal, states, duration=25.0)
    assert found.recovered.tolist() == [True, True, False, False]
    assert found.blown.tolist() == [False, False, False, True]
    assert np.isfinite(found.times[:2]).all()
    last = round(2 * goal.period / 1e-3)
    for state, error in zip(states[:3], found.errors, strict=False):
        alone = reservoir.with_copies(1)
        alone.restart(state[:1] + reservoir.qpos, state[1:])
        outputs = alone.rollout(25_000).outputs[0]
        assert orbit_error(outputs[-last::10], goal) == pytest.approx(error, abs=1e-9)
        np.testing.assert_array_equal(loop.run(state[None], 25_000).outputs[0], outputs)
    with pytest.raises(DivergenceError, match="copy 3"):
        advance(loop, states, 1000)
    assert on_cycle(loop, cycle, 3).shape == (3, 2)
    assert np.isfinite(pushed(loop, states[:3], np.full((3, 1), 0.1), 0.5)).all()


def test_noise_and_forces_are_tolerated_as_of_a_body(rayleigh):
    """Jitter is of first order in the noise; a kick of the cycle's own speed is recovered from."""
    _, loop, cycle = rayleigh
    one, twice = (phase_diffusion(loop, cycle, s, copies=8).jitter for s in (1e-4, 2e-4))
    assert twice == pytest.approx(2 * one, rel=1e-2)
    goal = limit_cycle(
        "rayleigh", lambda t, x: np.array([x[1], x[1] - x[1] ** 3 / 3 - x[0]]), [1.0, 0.0]
    )
    trial = Trial(hold=1.0, recovery=25.0, ratio=1e3)
    found = force_tolerance(loop, goal, on_cycle(loop, cycle, 2), trial)
    assert (found.values >= 1.0).all()


# --- symmetries ------------------------------------------------------------------------------


def swimmer(pos="0 0 0", quat="1 0 0 0"):
    reservoir = mcmj.Reservoir(
        SWIMMER.format(pos=pos, quat=quat), sensors=["jointpos:*", "jointvel:*"], channels=["m"],
        w_out=[[0.0], [0.0], [0.15], [0.0]],
    )  # fmt: skip
    qpos = reservoir.qpos
    qpos[7] = 0.3
    reservoir.set_state(qpos=qpos)
    reservoir.rollout(20_000, record=())
    return reservoir


def test_a_swimmer_elsewhere_and_turned_has_the_same_multipliers():
    """It goes round in circles: its state comes back only but for place and heading."""
    found = []
    for where in ({}, {"pos": "3 -2 1", "quat": ".5 .1 -.7 .4"}):
        loop = ReservoirLoop(swimmer(**where))
        assert loop.left_out == loop.names[:6]
        assert loop.size == 2 * 8 - 6
        cycle = find_cycle(loop, loop.now, 0.86, settle=60.0)
        found.append((cycle.period, multipliers_of(loop, cycle)))
    (period, one), (other_period, other) = found
    assert other_period == pytest.approx(period, rel=1e-11)
    np.testing.assert_allclose(other.multipliers, one.multipliers, atol=1e-8)
    assert one.neutral == 1
    assert one.leading_nontrivial < 0.95


def test_on_the_ground_place_and_heading_are_left_out_and_height_and_tilt_are_not():
    """A box with an oscillating mass, standing still, and one elsewhere and turned."""
    found = []
    for pos, quat in (("0 0 .1", "1 0 0 0"), ("1 2 .1", ".9 0 0 .4")):
        reservoir = mcmj.Reservoir(
            BOX.format(pos=pos, quat=quat), sensors=["jointpos:*", "jointvel:*"], channels=["m"],
            w_out=[[0.0], [0.5]],
        )  # fmt: skip
        reservoir.rollout(40_000, record=())
        loop = ReservoirLoop(reservoir)
        assert loop.left_out == ("root:x", "root:y", "root:yaw")
        cycle = find_cycle(loop, loop.now, 0.77, settle=20.0)
        found.append(multipliers_of(loop, cycle))
    one, other = (each.multipliers[:2] for each in found)
    np.testing.assert_allclose(other, one, atol=1e-8)
    assert abs(one[0] - 1) < 1e-8
    assert abs(one[1]) < 0.5
    assert abs(found[0].multipliers[2]) < 1e-7  # what the contact holds


def test_what_is_left_out_can_be_said():
    reservoir = swimmer()
    loop = ReservoirLoop(reservoir, left_out=["root:x"])
    assert loop.left_out == ("root:x",)
    assert loop.velocities == slice(7, 15)
    with pytest.raises(UnknownNameError, match="degree of freedom 'hip'; valid choices: a, b"):
        ReservoirLoop(reservoir, left_out=["hip"])


def test_a_reservoir_that_blows_up_must_be_told_what_is_cyclic():
    reservoir = mcmj.Reservoir(
        RAYLEIGH.format(h=1e-3), sensors=["jointvel:x"], channels=["m"], w_out=[[1e5]]
    )
    with pytest.raises(McmjError, match="blew up when it was stirred"):
        ReservoirLoop(reservoir)
    assert ReservoirLoop(reservoir, left_out=()).size == 2


# --- planar bodies ---------------------------------------------------------------------------


def test_a_planar_body_moves_in_mujoco_as_in_the_twin(body, w_bias):
    """Its monodromy matrix over 0.1 s, by differences of both and by the linearised step map."""
    simulation = mcmj.Simulation(body, w_out=w_bias, integrator="Euler")
    twin, loop = ClosedLoop(body, w_bias), ReservoirLoop(simulation, threads=2)
    assert loop.left_out == ()
    assert loop.size == twin.size
    z = twin.rest + 0.1 * np.random.default_rng(0).standard_normal(twin.size)
    cycle = replace(at_rest(twin, 0.1005), state=z)
    moved = replace(cycle, state=z - twin.rest)
    one, other = differences(twin, cycle), differences(loop, moved)
    np.testing.assert_allclose(other, one, atol=1e-9)
    np.testing.assert_allclose(other, variational(twin, z, 0.1005)[1], atol=1e-6)
    np.testing.assert_allclose(loop.outputs(moved.state[None]), twin.outputs(z[None]), rtol=1e-12)
    np.testing.assert_allclose(twin.scales(z + one), loop.scales(moved.state + one), rtol=1e-9)


def test_a_body_in_space_that_is_turned_has_the_same_multipliers():
    body = mcmj.random_body(0, nodes=8, depth=100)
    turn = Rotation.from_rotvec([0.3, -1.0, 0.7]).as_matrix()
    w_out = 0.05 * np.random.default_rng(0).standard_normal((body.n_springs, body.n_outputs))
    arrays = {name: getattr(body, name) for name in body.__dataclass_fields__}
    turned = {name: arrays[name] @ turn.T for name in ("positions", "direction")}
    found = []
    for one in (body, mcmj.Body(**arrays | turned)):
        loop = ReservoirLoop(mcmj.Simulation(one, w_out=w_out, integrator="Euler"))
        assert loop.left_out == ()
        cycle = replace(at_rest(loop, 1.0), scale=np.full(loop.size, 0.1))
        found.append(np.sort_complex(np.linalg.eigvals(differences(loop, cycle))))
    assert len(found[0]) == 6 * len(body.free)
    np.testing.assert_allclose(found[1], found[0], atol=5e-9)


@pytest.mark.slow
def test_a_taught_body_has_the_multipliers_of_its_twin(taught_loop):
    twin, cycle, _ = taught_loop
    simulation = mcmj.Simulation(twin.body, w_out=twin.w_out, integrator="Euler")
    loop = ReservoirLoop(simulation, threads=2)
    moved = replace(cycle, state=cycle.state - twin.rest)
    wanted, found = floquet(twin, cycle), multipliers_of(loop, moved)
    np.testing.assert_allclose(found.multipliers[:6], wanted.multipliers[:6], atol=1e-6)
    again = find_cycle(loop, moved.state, cycle.period, settle=1.0)
    assert again.period == pytest.approx(cycle.period, rel=1e-9)


# --- what is refused -------------------------------------------------------------------------


def test_loops_with_a_memory_are_refused_by_name(body, w_out):
    options = {"feedback_delay": 1, "substeps": 2, "integrator": "leapfrog", "engine": "twin"}
    for name, value in options.items():
        one = {"integrator": "Euler"} | {name: value}
        simulation = mcmj.Simulation(body, w_out=w_out, **one)
        with pytest.raises(InvalidArgumentError, match=name):
            ReservoirLoop(simulation)
    xml = RAYLEIGH.format(h=1e-3)
    for name, changes in (
        ("feedback_delay", {"feedback_delay": 2}),
        ("sensors", {"sensors": ["jointpos:x", "actuatorfrc:m"]}),
        ("reservoir", {"copies": 2}),
    ):
        given = {"sensors": ["jointpos:x"], "channels": ["m"], **changes}
        with pytest.raises(InvalidArgumentError, match=name):
            ReservoirLoop(mcmj.Reservoir(xml, **given))
    sensor = '<sensor><jointpos name="s" joint="x" delay=".01" nsample="20"/></sensor></mujoco>'
    late = mcmj.Reservoir(xml.replace("</mujoco>", sensor), sensors=["s"], channels=["m"])
    with pytest.raises(InvalidArgumentError, match="model: expected one without memory"):
        ReservoirLoop(late)


def test_what_is_for_planar_bodies_says_so(rayleigh):
    _, loop, cycle = rayleigh
    with pytest.raises(InvalidArgumentError, match="planar bodies only"):
        floquet(loop, cycle)
    with pytest.raises(InvalidArgumentError, match="planar bodies only"):
        directional(loop, cycle.state, np.eye(2), cycle.period, 1e-4)
    with pytest.raises(InvalidArgumentError, match="refine"):
        pushed(loop, cycle.state[None], None, 1.0, refine=5)
