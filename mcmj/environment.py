"""Bodies and tasks as dm_control environments; needs the extra "control".

The physics is dm_control's own Physics of the body file, with mcmj's compiled callback
installed: the feedback loop runs inside MuJoCo, and the agent acts beside it. The only module
that imports dm_control.
"""

import functools
from collections import OrderedDict

import numpy as np
from dm_control import mujoco
from dm_control.rl import control
from dm_control.suite import base
from dm_control.utils import rewards
from dm_env import specs

from mcmj import laws
from mcmj.body import Body
from mcmj.bodyfile import body_of_model, load_model, readouts_of_model
from mcmj.environment_setting import Setting
from mcmj.errors import InvalidArgumentError
from mcmj.library import body_names, body_path
from mcmj.mjcf import checked_readout, to_mjcf
from mcmj.orbit_window import OrbitWindow
from mcmj.simulation import Simulation
from mcmj.targets import TARGETS, Target, target
from mcmj.teaching import Teaching, synchronise, teach
from mcmj.validation import Array

RUNAWAY_LENGTH, RUNAWAY_OUTPUT = 10.0, 100.0  # of the body's size and the target's


class Physics(mujoco.Physics):
    """dm_control's Physics of one body, and what its readout says."""

    body: Body
    w_out: Array
    blew_up = False  # in this episode

    @classmethod
    def of_body(cls, body: Body, w_out: object, timestep: float, gate: float) -> "Physics":
        """A body with its readout (L or L + 1, n_outputs), the loop closed by `gate`."""
        readout = checked_readout(body, w_out)
        laws.install()
        physics = cls.from_xml_string(to_mjcf(body, timestep=timestep, w_out=readout))
        physics.model.actuator_biasprm[body.n_inputs :, 0] = gate
        physics.body, physics.w_out = body, readout
        return physics

    def step(self, n_sub_steps: int = 1) -> None:
        """As dm_control's; a blow-up is remembered, with the last good state, not raised."""
        before = self.get_state()
        try:
            super().step(n_sub_steps)
        except control.PhysicsError:
            self.blew_up = True
            self.set_state(before)
            with self.suppress_physics_errors():
                self.forward()

    def lengths(self) -> Array:
        """Spring lengths (L,) now [m]."""
        return self.data.sensordata[: self.body.n_springs].copy()

    def outputs(self) -> Array:
        """What the readout says now (n_outputs,)."""
        n = self.body.n_springs
        return self.lengths() @ self.w_out[:n] + self.w_out[n:].sum(axis=0)


class Orbit(base.Task):
    """Generate a target's orbit; the agent acts on input channels and fed-back outputs.

    Reward in [0, 1] from the orbit error of the last period (mcmj.orbit_window).

    Args:
        target: the orbit; its value at each moment is observed too.
        setting: what the agent may do.
        first: positions, velocities (N, 2) and time of an episode's start; None: rest.
        random: a seed or a RandomState, for the kick.
    """

    def __init__(
        self,
        body: Body,
        target: Target,
        setting: Setting,
        first: tuple[Array, Array, float] | None = None,
        random: int | np.random.RandomState = 0,
    ) -> None:
        super().__init__(random=random)
        self.target, self.setting = target, setting
        self._first = first
        limits = np.zeros(body.n_inputs + body.n_outputs)
        if setting.actions != "offsets":
            limits[: body.n_inputs] = setting.input_limit
        if setting.actions != "inputs":
            limits[body.n_inputs :] = setting.offset_limit
        self._channels = np.flatnonzero(limits)
        self._limits = limits[self._channels]
        if not self._channels.size:
            raise InvalidArgumentError("actions", "channels that the body has", setting.actions)
        self._window = OrbitWindow(target, setting.control_timestep)
        self._bounds = _observation_bounds(body, target)

    def reseed(self, seed: int) -> None:
        """Start the task's random numbers anew."""
        self.random.seed(seed)

    def initialize_episode(self, physics: Physics) -> None:
        """Rest or a point of the cycle, kicked."""
        laws.install()  # another package may have taken them out
        free = physics.body.free
        velocities = self.setting.kick * self.random.standard_normal((len(free), 2))
        if self._first is not None:
            positions, moving, physics.data.time = self._first
            physics.data.qpos[:] = (positions - physics.body.positions)[free].ravel()
            velocities += moving[free]
        physics.data.qvel[:] = velocities.ravel()
        physics.blew_up = False
        self._window.clear()
        super().initialize_episode(physics)

    def before_step(self, action: Array, physics: Physics) -> None:
        """Actions beyond their bounds are clipped."""
        physics.data.ctrl[self._channels] = np.clip(action, -self._limits, self._limits)

    def after_step(self, physics: Physics) -> None:
        """Remember the outputs."""
        self._window.add(physics.outputs())

    def action_spec(self, physics: Physics) -> specs.BoundedArray:
        """Inputs [units of the channel], then offsets [units of the outputs]."""
        return specs.BoundedArray(
            self._limits.shape, np.float64, -self._limits, self._limits, name="action"
        )

    def get_observation(self, physics: Physics) -> OrderedDict[str, Array]:
        """Spring lengths [m], outputs, and the target's value now, clipped at their bounds."""
        values = {
            "lengths": physics.lengths(),
            "outputs": physics.outputs(),
            "target": self.target.sample([physics.time()])[0],
        }
        return OrderedDict((name, np.clip(values[name], *self._bounds[name])) for name in values)

    def observation_spec(self, physics: Physics) -> OrderedDict[str, specs.BoundedArray]:
        """Lengths to 10 times the body's size, outputs to 100 times the target's."""
        return OrderedDict(
            (name, specs.BoundedArray(low.shape, np.float64, low, high, name=name))
            for name, (low, high) in self._bounds.items()
        )

    def get_termination(self, physics: Physics) -> float | None:
        """0 if the body blew up, or its outputs have run away to their bounds."""
        largest = np.abs(physics.outputs()).max()
        gone = physics.blew_up or largest >= self._bounds["outputs"][1][0]
        return 0.0 if gone else None

    def get_reward(self, physics: Physics) -> float:
        """1 up to the orbit error `good`, 0.1 a margin further, by a Gaussian."""
        if physics.blew_up:
            return 0.0
        setting = self.setting
        bounds = (0.0, setting.good)
        return float(rewards.tolerance(self._window.error, bounds=bounds, margin=setting.margin))


class Environment(control.Environment):
    """dm_control's Environment with a bounded reward."""

    def reward_spec(self) -> specs.BoundedArray:
        """In [0, 1]."""
        return specs.BoundedArray((), float, 0.0, 1.0, name="reward")


def make(
    body: Body,
    w_out: object,
    target: Target,
    setting: Setting | None = None,
    random: int | np.random.RandomState = 0,
) -> Environment:
    """An environment of a body with its readout.

    Args:
        w_out: (L or L + 1, n_outputs).
        random: a seed or a RandomState; the same seed gives the same episodes.

    Raises:
        InvalidArgumentError: a readout, target or setting that does not fit the body.
    """
    setting = setting or Setting()
    if body.n_outputs != target.n_outputs:
        raise InvalidArgumentError("body", f"{target.n_outputs} outputs", body.n_outputs)
    physics = Physics.of_body(body, w_out, setting.timestep, setting.gate)
    first = _on_cycle(body, target, setting.timestep) if setting.start == "cycle" else None
    return Environment(
        physics,
        Orbit(body, target, setting, first, random),
        time_limit=setting.time_limit,
        control_timestep=setting.control_timestep,
    )


def load(
    name: str,
    task: str | None = None,
    setting: Setting | None = None,
    random: int | np.random.RandomState = 0,
) -> Environment:
    """The environment of a body by its name, or of a body file, in the manner of the suite.

    Args:
        name: a body that comes with mcmj, or a path; see `body_names`.
        task: name of a target; default: what the file's first readout is called. Without a
            readout for it in the file the body is taught it first.
        setting, random: see `make`.

    Raises:
        UnknownNameError: no such body or task.
    """
    body, readouts = _body_and_readouts(name)
    task = task or next((kind for kind in readouts if kind in TARGETS), "van_der_pol")
    wanted = target(task)
    w_out = readouts[task] if task in readouts else _taught(name, task)
    return make(body, w_out, wanted, setting, random)


def all_tasks() -> list[tuple[str, str]]:
    """Names of bodies that come with mcmj, and of tasks that their files hold readouts for."""
    return [
        (name, task)
        for name in body_names()
        for task in _body_and_readouts(name)[1]
        if task in TARGETS
    ]


def _observation_bounds(body: Body, wanted: Target) -> dict[str, tuple[Array, Array]]:
    orbit = wanted.orbit(4096)
    low, high = orbit.min(axis=0), orbit.max(axis=0)
    slack = 1e-3 * (high - low)  # between the orbit's points
    longest = np.full(body.n_springs, RUNAWAY_LENGTH * np.ptp(body.positions, axis=0).max())
    largest = np.full(body.n_outputs, RUNAWAY_OUTPUT * np.abs(orbit).max())
    return {
        "lengths": (np.zeros(body.n_springs), longest),
        "outputs": (-largest, largest),
        "target": (low - slack, high + slack),
    }


def _body_and_readouts(name: str) -> tuple[Body, dict[str, Array]]:
    model = load_model(body_path(name))
    return body_of_model(model), readouts_of_model(model)


@functools.cache
def _taught(name: str, task: str) -> Array:
    simulation = Simulation(_body_and_readouts(name)[0])
    return teach(simulation, target(task), Teaching(), seed=0).w_out


def _on_cycle(body: Body, wanted: Target, timestep: float) -> tuple[Array, Array, float]:
    simulation = Simulation(body, timestep=timestep)
    synchronise(simulation, wanted, Teaching().washout)
    state = simulation.state
    return state.positions, state.velocities, state.time
