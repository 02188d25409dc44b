"""The robot of mcmj.robots.trunk in MuJoCo: a readout of its springs' lengths drives its muscles.

    c_j = sum_i w_ij (l_i - l_i*) + w_0j      l*: the lengths at rest, as the robot was drawn

is the actuator law of every body of mcmj, on the muscles' tendons: nothing else closes the
loop. The ground is a plane below the feet, which alone touch it. Trunk and muscles are heavily
damped: Euler blows up at 1 ms, and a robot that has learned under implicitfast mostly falls at
half its step, which it does not under MuJoCo's discrete integrator.
"""

import mujoco
import numpy as np
from mujoco.batch import Batch

from mcmj.core.callbacks import install
from mcmj.core.callbacks.pointers import TAG
from mcmj.core.integrators import integrator_named
from mcmj.mjcf.write import to_mjcf
from mcmj.robots.quadruped import GRAVITY
from mcmj.robots.trunk import N_MUSCLES, Trunk
from mcmj.robots.walk_metrics import Walk
from mcmj.targets.gaits import LEGS
from mcmj.utils.errors import DivergenceError, InvalidArgumentError
from mcmj.utils.quiet import quiet_warnings
from mcmj.utils.validation import Array, as_array, require_number

INTEGRATOR = "discrete"
TIMESTEP = 1e-3  # s
STAND = 2.0  # s until a robot that is let go stands still
PUSH_DURATION = 0.1  # s
_POSITION_STAGE = mujoco.mjtStage.mjSTAGE_POS.value
_VELOCITY_STAGE = mujoco.mjtStage.mjSTAGE_VEL.value


def trunk_model(
    trunk: Trunk, *, timestep: float, integrator: str = INTEGRATOR, ground: bool = True
) -> mujoco.MjModel:
    """The model of a robot, with actuator m<j> on muscle j and sensor load<i> on foot i.

    Raises:
        InvalidArgumentError, UnknownNameError: an argument out of bounds.
    """
    if integrator_named(integrator).by_callback:
        raise InvalidArgumentError("integrator", "one of MuJoCo's", integrator)
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
        foot = spec.body(f"n{n + i}")
        foot.add_geom(
            name=leg, type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[settings.foot, 0, 0], mass=0,
            contype=1, conaffinity=0, friction=[settings.friction, 0.005, 0.0001],
            rgba=[0.2, 0.22, 0.28, 1.0],
        )  # fmt: skip
        foot.add_site(name=leg, size=[1.1 * settings.foot, 0, 0], rgba=[0, 0, 0, 0])
        spec.add_sensor(
            name=f"load{i}", type=mujoco.mjtSensor.mjSENS_TOUCH,
            objtype=mujoco.mjtObj.mjOBJ_SITE, objname=leg,
        )  # fmt: skip
    for j in range(N_MUSCLES):
        strength = settings.muscle_strength
        muscle = spec.add_actuator(
            name=f"m{j}", target=f"s{trunk.n_sensed + j}", trntype=mujoco.mjtTrn.mjTRN_TENDON,
            biastype=mujoco.mjtBias.mjBIAS_USER, forcelimited=1, forcerange=[-strength, strength],
        )  # fmt: skip
        muscle.biasprm[:5] = [0.0, TAG, 0.0, trunk.n_sensed, 0.0]
        muscle.gainprm[0] = settings.muscle_stiffness
    spec.nuser_actuator = trunk.n_sensed + 1
    return spec.compile()


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


class TrunkWalker:
    """A robot; the state carries over from walk to walk.

    Args:
        trunk: the robot.
        timestep: physics step [s].
        integrator: one of MuJoCo's.
        ground: without it the robot falls freely.

    Raises:
        InvalidArgumentError, UnknownNameError: an argument out of bounds.
    """

    def __init__(
        self,
        trunk: Trunk,
        *,
        timestep: float = TIMESTEP,
        integrator: str = INTEGRATOR,
        ground: bool = True,
    ) -> None:
        self.trunk, self.timestep = trunk, timestep
        install.install()  # first: MuJoCo's compiler calls it too
        self.model = trunk_model(trunk, timestep=timestep, integrator=integrator, ground=ground)
        self._batch = Batch(self.model, 1, 1)
        self._w_out = np.zeros((trunk.n_sensed + 1, N_MUSCLES))
        self._gate = 0.0
        for name in ("sensordata", "actuator_force", "actuator_velocity"):
            self._batch.bind(name)  # copied out by calls after this one only
        self._batch.reset()

    @property
    def state(self) -> Array:
        """All that `restore` needs (n,); readout and gate stay what they are."""
        found: Array = self._batch.state[0].copy()
        return found

    @property
    def w_out(self) -> Array:
        """The readout in use, (n_sensed + 1, N_MUSCLES)."""
        return self._w_out

    def restore(self, state: Array) -> None:
        """Go back to a state, bit for bit."""
        self._batch.state[0] = state
        with quiet_warnings():
            self._batch.forward(stage=_POSITION_STAGE)  # lengths are no part of the state

    def stand(self) -> None:
        """Let go of the robot as it was drawn, muscles at rest, until it stands."""
        self._batch.reset()
        self.close(False)
        self.advance(round(STAND / self.timestep))

    def close(self, closed: bool) -> None:
        """Close or open the loop."""
        self._gate = self.trunk.settings.muscle_stiffness if closed else 0.0
        self._batch.expand("actuator_biasprm")[:, :, 0] = self._gate

    def set_readout(self, w_out: Array) -> None:
        """The readout w (n_sensed + 1, N_MUSCLES) [m/m], the constants w_0 [m] in the last row."""
        n = self.trunk.n_sensed
        self._w_out = as_array("w_out", w_out, (n + 1, N_MUSCLES))
        weights = self._batch.expand("actuator_user")
        weights[0] = self._w_out.T
        weights[0, :, n] -= self.trunk.body.rest_lengths[:n] @ self._w_out[:n]

    def features(self) -> Array:
        """What the readout is applied to, (n_sensed + 1,): l - l* now [m], and 1."""
        n = self.trunk.n_sensed
        lengths = self._batch.bind("sensordata")[0, :n]
        return np.append(lengths - self.trunk.body.rest_lengths[:n], 1.0)

    def advance(self, steps: int, commands: Array | None = None) -> None:
        """Go on for so many steps, with a teacher's or noise's commands (N_MUSCLES,) [m] on top.

        Raises:
            DivergenceError: the robot blew up.
        """
        self._batch.bind("ctrl")[0] = 0.0 if commands is None else commands
        install.install()  # as before every run: somebody may have taken them out
        with quiet_warnings():
            self._batch.step(nstep=steps, stage=_POSITION_STAGE)
        self._check_alive()

    def walk(
        self, duration: float, *, push: float = 0.0, sample: float = 0.01, joints: bool = False
    ) -> Walk:
        """Go on in closed loop, or as it stands, for a while; outputs are the commands c [m].

        Args:
            duration: [s].
            push: impulse forwards on the trunk [N s], a constant force on all of its nodes over
                the first PUSH_DURATION, rounded to whole samples.
            sample: time between samples [s], rounded to whole steps.
            joints: record all joints, for videos.

        Raises:
            DivergenceError: the robot blew up.
        """
        require_number("duration", duration, 2 * sample)
        stride = max(1, round(sample / self.timestep))
        count = round(duration / (stride * self.timestep))
        force, n = self._batch.bind("qfrc_applied"), self.trunk.settings.nodes
        pushes = max(1, round(PUSH_DURATION / (stride * self.timestep)))  # samples it lasts
        self._batch.bind("ctrl")[0] = 0.0
        rows: dict[str, list[Array]] = {}
        install.install()
        for k in range(count):
            share = push / n / (pushes * stride * self.timestep)
            force[0, 0 : 2 * n : 2] = share if k < pushes else 0.0
            with quiet_warnings():
                self._batch.step(nstep=stride, stage=_VELOCITY_STAGE)
            for name, values in self._sample(joints).items():
                rows.setdefault(name, []).append(values)
        force[:] = 0.0
        self._check_alive()
        times = stride * self.timestep * np.arange(1, count + 1, dtype=np.float64)
        return Walk(times, **{name: np.stack(values, axis=1) for name, values in rows.items()})

    # --- inside ------------------------------------------------------------------------------

    def _sample(self, joints: bool) -> dict[str, Array]:
        qpos = self._batch.bind("qpos").copy()
        sensors = self._batch.bind("sensordata")
        power = self._batch.bind("actuator_force") * self._batch.bind("actuator_velocity")
        closed = float(self._gate > 0.0)
        now = {
            "trunk": self._pose(qpos[0])[None],
            "outputs": closed * (self.features() @ self._w_out)[None],
            "contact": sensors[:, -len(LEGS) :].copy(),
            "power": np.maximum(power, 0.0).sum(axis=1),
        }
        return now | {"joints": qpos} if joints else now

    def _pose(self, qpos: Array) -> Array:
        """The trunk's middle and orientation as if it were rigid, heights along z (7,)."""
        n = self.trunk.settings.nodes
        drawn = self.trunk.body.positions[:n]
        nodes = drawn + qpos[: 2 * n].reshape(n, 2)
        middle = nodes.mean(axis=0)
        a, b = drawn - drawn.mean(axis=0), nodes - middle
        tilt = np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum())
        return np.array([
            middle[0], 0.0, middle[1], np.cos(tilt / 2), 0.0, -np.sin(tilt / 2), 0.0
        ])  # fmt: skip

    def _check_alive(self) -> None:
        if not np.isfinite(self._batch.bind("qvel")).all():
            time = float(self._batch.bind("time")[0])
            raise DivergenceError(
                f"the robot blew up before t = {time:.6g} s, step {1e3 * self.timestep:g} ms; try "
                "a smaller step, or weaker muscles",
                time=time, steps_done=round(time / self.timestep),
            )  # fmt: skip
