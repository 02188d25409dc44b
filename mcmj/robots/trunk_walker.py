"""The robot of mcmj.robots.trunk in MuJoCo: a readout of its springs' lengths drives its muscles.

    c_j = sum_i w_ij l_i + w_0j,    force of muscle j = k c_j, on top of its own spring

The robot is a reservoir (mcmj.Reservoir), its signals the lengths of the trunk's springs, its
outputs the c_j: nothing else closes the loop. The ground is a plane below the feet, which alone
touch it. Trunk and muscles are heavily damped: Euler blows up at 1 ms, and a robot that has
learned under implicitfast mostly falls at half its step, which it does not under MuJoCo's discrete
integrator.
"""

from collections.abc import Callable

import mujoco
import numpy as np

from mcmj.core.integrators import integrator_named
from mcmj.core.trajectory import Trajectory
from mcmj.mjcf.write import to_mjcf
from mcmj.robots.quadruped import GRAVITY
from mcmj.robots.trunk import N_MUSCLES, Trunk
from mcmj.robots.walk_metrics import Walk, fallen
from mcmj.simulation.reservoir import CHUNK, Reservoir
from mcmj.targets.gaits import LEGS
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, require_number

INTEGRATOR = "discrete"
TIMESTEP = 1e-3  # s
STAND = 2.0  # s until a robot that is let go stands still
PUSH_DURATION = 0.1  # s
SAMPLE = 0.01  # s, of a walk


def new_robot(
    trunk: Trunk,
    *,
    timestep: float = TIMESTEP,
    integrator: str = INTEGRATOR,
    ground: bool = True,
) -> Reservoir:
    """A robot as a reservoir.

    Args:
        timestep: [s].
        integrator: one of MuJoCo's.
        ground: without it the robot falls freely.

    Raises:
        InvalidArgumentError, UnknownNameError: an argument out of bounds.
    """
    if integrator_named(integrator).by_callback:
        raise InvalidArgumentError("integrator", "one of MuJoCo's", integrator)
    return Reservoir(
        trunk_spec(trunk, timestep, integrator, ground=ground),
        sensors=[f"length{i}" for i in range(trunk.n_sensed)],
        channels="m*",
    )


def trunk_spec(
    trunk: Trunk, timestep: float, integrator: str, *, ground: bool = True
) -> mujoco.MjSpec:
    """The model of a robot: actuator m<j> is muscle j; sensors load<i>, force<j>, velocity<j>."""
    settings, n = trunk.settings, trunk.settings.nodes
    spec = mujoco.MjSpec.from_string(to_mjcf(trunk.body, timestep=timestep, integrator=integrator))
    spec.option.gravity = [0.0, -GRAVITY, 0.0]
    # contacts need constraints; a state that blew up is kept for the error message
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_AUTORESET.value
    upright = [np.sqrt(0.5), -np.sqrt(0.5), 0.0, 0.0]
    spec.worldbody.add_geom(
        name="ground", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], quat=upright,
        pos=[0, -settings.foot, 0], contype=0, conaffinity=int(ground), material=_squares(spec),
    )  # fmt: skip
    for i, leg in enumerate(LEGS):
        _add_foot(spec, trunk, f"n{n + i}", leg, f"load{i}")
    strength, sensor = settings.muscle_strength, mujoco.mjtSensor
    told = {"force": sensor.mjSENS_ACTUATORFRC, "velocity": sensor.mjSENS_ACTUATORVEL}
    for j in range(N_MUSCLES):
        muscle = spec.add_actuator(
            name=f"m{j}", target=f"s{trunk.n_sensed + j}", trntype=mujoco.mjtTrn.mjTRN_TENDON,
            forcelimited=1, forcerange=[-strength, strength],
        )  # fmt: skip
        muscle.gainprm[0] = settings.muscle_stiffness
        for name, what in told.items():
            spec.add_sensor(
                name=f"{name}{j}", type=what, objtype=mujoco.mjtObj.mjOBJ_ACTUATOR, objname=f"m{j}"
            )
    return spec


def _add_foot(spec: mujoco.MjSpec, trunk: Trunk, body: str, leg: str, load: str) -> None:
    """A sphere that touches the ground, and a sensor of its load."""
    foot, size = spec.body(body), trunk.settings.foot
    foot.add_geom(
        name=leg, type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[size, 0, 0], mass=0,
        contype=1, conaffinity=0, friction=[trunk.settings.friction, 0.005, 0.0001],
        rgba=[0.2, 0.22, 0.28, 1.0],
    )  # fmt: skip
    foot.add_site(name=leg, size=[1.1 * size, 0, 0], rgba=[0, 0, 0, 0])
    spec.add_sensor(
        name=load, type=mujoco.mjtSensor.mjSENS_TOUCH,
        objtype=mujoco.mjtObj.mjOBJ_SITE, objname=leg,
    )  # fmt: skip


def _squares(spec: mujoco.MjSpec) -> str:
    """A material for the ground, on which motion shows: squares of 0.25 m."""
    spec.add_texture(
        name="squares", type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=[0.97, 0.97, 0.95], rgb2=[0.84, 0.86, 0.83], width=64, height=64,
    )  # fmt: skip
    textures = [""] * mujoco.mjtTextureRole.mjNTEXROLE
    textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "squares"
    spec.add_material(name="squares", textures=textures, texrepeat=[4, 4], texuniform=True)
    return "squares"


def stand(robot: Reservoir) -> None:
    """Let go of a robot as it was drawn, muscles at rest, until it stands."""
    robot.reset()
    robot.rollout(round(STAND / robot.timestep), gate=0.0, record=())


def walk(
    robot: Reservoir, trunk: Trunk, duration: float, *, push: float = 0.0, sample: float = SAMPLE
) -> Walk:
    """Go on with the readout there is; outputs are the commands c [m].

    Args:
        duration: [s].
        push: impulse forwards on the trunk [N s], a constant force on all of its nodes over the
            first PUSH_DURATION.
        sample: time between samples [s], rounded to whole steps.

    Raises:
        DivergenceError: the robot blew up.
    """
    require_number("duration", duration, 2 * sample)
    stride = max(1, round(sample / robot.timestep))
    total = round(duration / robot.timestep)
    pushed = min(total, round(PUSH_DURATION / robot.timestep)) if push else 0
    record, chunk = ("outputs", "qpos", "sensordata"), CHUNK // stride * stride
    parts = []
    if pushed:
        force = push / (pushed * robot.timestep) / trunk.settings.nodes
        forces = {f"n{i}": (force, 0.0, 0.0) for i in range(trunk.settings.nodes)}
        parts.append(robot.rollout(pushed, forces=forces, record=record))
    if total > pushed:
        parts += robot.stream(total - pushed, record=record, chunk=chunk)
    rows = {
        name: np.concatenate([part.get(name)[::stride] for part in parts])[None] for name in record
    }
    sensors = {
        name: rows["sensordata"][..., _places(robot, name, count)]
        for name, count in (("load", len(LEGS)), ("force", N_MUSCLES), ("velocity", N_MUSCLES))
    }
    return Walk(
        times=stride * robot.timestep * np.arange(rows["qpos"].shape[1], dtype=np.float64),
        trunk=poses(trunk, rows["qpos"]),
        outputs=rows["outputs"],
        contact=sensors["load"],
        power=np.maximum(sensors["force"] * sensors["velocity"], 0.0).sum(axis=-1),
        joints=rows["qpos"],
    )


def has_fallen(trunk: Trunk) -> Callable[[Trajectory], bool]:
    """Whether a robot falls in a run of which qpos was recorded; see walk_metrics."""
    return lambda run: bool(fallen(poses(trunk, run.get("qpos")[::10]), trunk.settings.leg).any())


def poses(trunk: Trunk, qpos: Array) -> Array:
    """The trunk's middle and orientation (.., 7) as if it were rigid, heights along z."""
    n = trunk.settings.nodes
    drawn = trunk.body.positions[:n]
    nodes = drawn + qpos[..., : 2 * n].reshape(*qpos.shape[:-1], n, 2)
    middle = nodes.mean(axis=-2)
    a, b = drawn - drawn.mean(axis=0), nodes - middle[..., None, :]
    turned = (a[:, 0] * b[..., 1] - a[:, 1] * b[..., 0]).sum(axis=-1)
    half, zero = np.arctan2(turned, (a * b).sum(axis=(-1, -2))) / 2, np.zeros(middle.shape[:-1])
    return np.stack(
        [middle[..., 0], zero, middle[..., 1], np.cos(half), zero, -np.sin(half), zero], axis=-1
    )


def _places(robot: Reservoir, name: str, count: int) -> list[int]:
    """Of sensors name0, name1, .. in sensordata."""
    return [int(robot.model.sensor(f"{name}{i}").adr[0]) for i in range(count)]
