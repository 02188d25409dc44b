"""The robot of mcmj.robots.trunk in MuJoCo: a readout of its springs' lengths drives its muscles.

    c_j = sum_i w_ij l_i + w_0j,    force of muscle j = k c_j, on top of its own spring

The robot is a reservoir (mcmj.Reservoir), its signals the lengths of the trunk's springs, its
outputs the c_j: nothing else closes the loop. The ground is a plane below the feet, which alone
touch it. Trunk and muscles are heavily damped. In the plane Euler blows up at 1 ms, and a robot
that has learned under implicitfast mostly falls at half its step, which it does not under MuJoCo's
discrete integrator. In space, with dampers half as strong, Euler is stable at 0.4 ms: there it is
cheaper than discrete at 1 ms, and more accurate (docs/experiments/soft_robot.md). Friction is that
of elliptic cones, tangential constraints ten times as hard as normal ones, or standing feet creep.
"""

from collections.abc import Callable

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from mcmj.core.integrators import integrator_named
from mcmj.core.trajectory import Trajectory
from mcmj.mjcf.write import to_mjcf
from mcmj.robots.ground import SQUARES, paint_squares
from mcmj.robots.quadruped import GRAVITY
from mcmj.robots.recorded_walk import record_walk
from mcmj.robots.trunk import Trunk
from mcmj.robots.walk_metrics import Walk, fallen, headings
from mcmj.simulation.reservoir import Reservoir
from mcmj.targets.gaits import LEGS
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array

STEPS = {2: ("discrete", 1e-3), 3: ("Euler", 4e-4)}  # by dimensions: integrator, time step [s]
STEP_LENGTH, N_STEPS = 0.5, 60  # m
STAND = 2.0  # s until a robot that is let go stands still
SAMPLE = 0.01  # s, of a walk


def new_robot(
    trunk: Trunk,
    *,
    timestep: float | None = None,
    integrator: str | None = None,
    ground: bool = True,
    slope: float = 0.0,
    step: float = 0.0,
    bias: Array | None = None,
) -> Reservoir:
    """A robot as a reservoir.

    Args:
        timestep: [s]; default: of STEPS, as the integrator's.
        integrator: one of MuJoCo's.
        ground: without it the robot falls freely.
        slope: of the ground, upwards ahead [rad].
        step: height of bars across the way, one in every other STEP_LENGTH [m]; in space.

        bias: (n_muscles,) what the robot's one input adds to the muscles' commands at 1 [m];
            default: there is no input.

    Raises:
        InvalidArgumentError, UnknownNameError: an argument out of bounds.
    """
    usual = STEPS[trunk.body.dimensions]
    integrator = integrator or usual[0]
    if integrator_named(integrator).by_callback:
        raise InvalidArgumentError("integrator", "one of MuJoCo's", integrator)
    spec = trunk_spec(trunk, timestep or usual[1], integrator, ground=ground)
    spec.option.gravity = spec.option.gravity * np.cos(slope) - [GRAVITY * np.sin(slope), 0.0, 0.0]
    if step:
        _add_steps(spec, trunk, step)
    return Reservoir(
        spec,
        sensors=[f"length{i}" for i in range(trunk.n_sensed)],
        channels="m*",
        inputs=() if bias is None else {"u": {f"m{j}": float(b) for j, b in enumerate(bias)}},
    )


def _add_steps(spec: mujoco.MjSpec, trunk: Trunk, height: float) -> None:
    """Bars that begin in front of the robot, and turn with nothing."""
    first, below = trunk.settings.width + STEP_LENGTH, -trunk.settings.foot
    for i in range(N_STEPS):
        spec.worldbody.add_geom(
            name=f"step{i}", type=mujoco.mjtGeom.mjGEOM_BOX, contype=0, conaffinity=1,
            size=[STEP_LENGTH / 2, 50.0, height], rgba=[0.75, 0.73, 0.7, 1.0],
            pos=[first + 2 * i * STEP_LENGTH, 0.0, below],
        )  # fmt: skip


def trunk_spec(
    trunk: Trunk, timestep: float, integrator: str, *, ground: bool = True
) -> mujoco.MjSpec:
    """The model of a robot: actuator m<j> is muscle j; sensors as recorded_walk asks for."""
    settings, n = trunk.settings, trunk.settings.nodes
    spec = mujoco.MjSpec.from_string(to_mjcf(trunk.body, timestep=timestep, integrator=integrator))
    up = np.eye(3)[trunk.body.dimensions - 1]
    spec.option.gravity = -GRAVITY * up
    if trunk.body.dimensions == 3:
        spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        spec.option.impratio = 10.0
    # contacts need constraints; a state that blew up is kept for the error message
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_AUTORESET.value
    paint_squares(spec, 0.25, (0.97, 0.84))
    turned = [1.0, 0.0, 0.0, 0.0] if up[2] else [np.sqrt(0.5), -np.sqrt(0.5), 0.0, 0.0]
    spec.worldbody.add_geom(
        name="ground", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], quat=turned,
        pos=-settings.foot * up, contype=0, conaffinity=int(ground), material=SQUARES,
    )  # fmt: skip
    for i, leg in enumerate(LEGS):
        _add_foot(spec, trunk, f"n{n + i}", leg)
    strength, sensor = settings.muscle_strength, mujoco.mjtSensor
    told = {"force": sensor.mjSENS_ACTUATORFRC, "speed": sensor.mjSENS_ACTUATORVEL}
    for j in range(trunk.n_muscles):
        muscle = spec.add_actuator(
            name=f"m{j}", target=f"s{trunk.n_sensed + j}", trntype=mujoco.mjtTrn.mjTRN_TENDON,
            forcelimited=1, forcerange=[-strength, strength],
        )  # fmt: skip
        muscle.gainprm[0] = settings.muscle_stiffness
        for name, what in told.items():
            spec.add_sensor(
                name=f"m{j}_{name}", type=what, objtype=mujoco.mjtObj.mjOBJ_ACTUATOR,
                objname=f"m{j}",
            )  # fmt: skip
    return spec


def _add_foot(spec: mujoco.MjSpec, trunk: Trunk, body: str, leg: str) -> None:
    """A sphere that touches the ground, and a sensor of its load."""
    foot, size = spec.body(body), trunk.settings.foot
    foot.add_geom(
        name=leg, type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[size, 0, 0], mass=0,
        contype=1, conaffinity=0, friction=[trunk.settings.friction, 0.005, 0.0001],
        rgba=[0.2, 0.22, 0.28, 1.0],
    )  # fmt: skip
    foot.add_site(name=leg, size=[1.1 * size, 0, 0], rgba=[0, 0, 0, 0])
    spec.add_sensor(
        name=f"{leg}_contact", type=mujoco.mjtSensor.mjSENS_TOUCH,
        objtype=mujoco.mjtObj.mjOBJ_SITE, objname=leg,
    )  # fmt: skip


def stand(robot: Reservoir) -> None:
    """Let go of a robot as it was drawn, muscles at rest, until it stands."""
    robot.reset()
    robot.rollout(round(STAND / robot.timestep), gate=0.0, record=())


def walk(
    robot: Reservoir,
    trunk: Trunk,
    duration: float,
    *,
    push: float = 0.0,
    axis: int = 0,
    told: float | None = None,
    sample: float = SAMPLE,
) -> Walk:
    """Go on with the readout there is; outputs are the commands c [m]. See record_walk.

    Args:
        duration: [s].
        push: impulse on the trunk [N s], a constant force on all of its nodes ..
        axis: .. along x, forwards, or in space along y, 1, to the left.
        told: the input of a robot that has one, held.
        sample: time between samples [s].

    Raises:
        DivergenceError: the robot blew up.
    """
    n = trunk.settings.nodes
    share = push / n * np.eye(3)[axis]
    return record_walk(
        robot, duration, sample, lambda qpos: poses(trunk, qpos), n_outputs=trunk.n_muscles,
        joints=True, told=told,
        impulses={f"n{i}": share for i in range(n)} if push else None,
    )  # fmt: skip


def heading_ahead(trunk: Trunk, robot: Reservoir) -> tuple[Array, Array]:
    """qpos and qvel of a robot in space, carried back to the start and turned along x."""
    pose = poses(trunk, robot.qpos)
    turn = Rotation.from_euler("z", -float(headings(pose[None])[0])).as_matrix()
    drawn = trunk.body.positions
    middle = pose[:3] * [1.0, 1.0, 0.0]
    start = drawn[: trunk.settings.nodes].mean(axis=0) * [1.0, 1.0, 0.0]
    nodes = (drawn + robot.qpos.reshape(drawn.shape) - middle) @ turn.T + start
    return (nodes - drawn).ravel(), (robot.qvel.reshape(drawn.shape) @ turn.T).ravel()


def has_fallen(trunk: Trunk) -> Callable[[Trajectory], bool]:
    """Whether a robot falls in a run of which qpos was recorded; see walk_metrics."""
    return lambda run: bool(fallen(poses(trunk, run.get("qpos")[::10]), trunk.settings.leg).any())


def poses(trunk: Trunk, qpos: Array) -> Array:
    """The trunk's middle and orientation (.., 7) as if it were rigid, heights along z."""
    n, dimensions = trunk.settings.nodes, trunk.body.dimensions
    drawn = trunk.body.positions[:n]
    nodes = drawn + qpos[..., : dimensions * n].reshape(*qpos.shape[:-1], n, dimensions)
    middle = nodes.mean(axis=-2)
    a, b = drawn - drawn.mean(axis=0), nodes - middle[..., None, :]
    if dimensions == 3:
        return np.concatenate([middle, _quaternions(a, b)], axis=-1)
    turned = (a[:, 0] * b[..., 1] - a[:, 1] * b[..., 0]).sum(axis=-1)
    half, zero = np.arctan2(turned, (a * b).sum(axis=(-1, -2))) / 2, np.zeros(middle.shape[:-1])
    return np.stack(
        [middle[..., 0], zero, middle[..., 1], np.cos(half), zero, -np.sin(half), zero], axis=-1
    )


def _quaternions(a: Array, b: Array) -> Array:
    """Rotations (.., 4), w first, that bring a (n, 3) closest to b (.., n, 3): Kabsch's."""
    u, _, vt = np.linalg.svd(np.einsum("ni,...nj->...ij", a, b))
    sign = np.sign(np.linalg.det(u) * np.linalg.det(vt))
    u[..., 2] *= sign[..., None]
    turns = Rotation.from_matrix((np.swapaxes(u @ vt, -1, -2)).reshape(-1, 3, 3))
    found: Array = np.roll(turns.as_quat(), 1, axis=-1).reshape(*b.shape[:-2], 4)
    return found
