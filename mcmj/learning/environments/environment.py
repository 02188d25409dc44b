"""Bodies and tasks as dm_control environments; needs the extra "control".

The physics is dm_control's own Physics of the body file, with mcmj's compiled callbacks
installed: the feedback loop runs inside MuJoCo, and the agent acts beside it. The only module
that imports dm_control.
"""

from collections import OrderedDict

import numpy as np

from mcmj.core.body import Body
from mcmj.core.callbacks import install
from mcmj.core.options import Options
from mcmj.core.readout import Readout, checked_readout
from mcmj.core.trajectory import State
from mcmj.learning.environments.setting import Setting
from mcmj.learning.environments.tasks import all_tasks as all_tasks
from mcmj.learning.environments.tasks import assign, state_on_cycle
from mcmj.metrics.orbit_window import OrbitWindow
from mcmj.mjcf.write import to_mjcf
from mcmj.simulation.stepsize.limit import warn_if_unstable
from mcmj.targets.limit_cycles import Target
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.extras import extra
from mcmj.utils.validation import Array, as_array

with extra("control", "environments need dm_control"):
    from dm_control import mujoco
    from dm_control.rl import control
    from dm_control.suite import base
    from dm_control.utils import rewards
    from dm_env import specs

RUNAWAY_LENGTH, RUNAWAY_OUTPUT = 10.0, 100.0  # of the body's size and the target's


class Physics(mujoco.Physics):
    """dm_control's Physics of one body, and what its readout says."""

    body: Body
    w_out: Array
    blew_up = False  # in this episode

    @classmethod
    def of_body(cls, body: Body, w_out: object, setting: Setting) -> "Physics":
        """A body with its readout (L or L + 1, n_outputs), stepped as the setting says."""
        readout = checked_readout(body, w_out)
        install.install(passive=setting.passive)
        xml = to_mjcf(body, timestep=setting.timestep, integrator=setting.integrator, w_out=readout)
        physics: Physics = cls.from_xml_string(xml)
        physics.model.actuator_biasprm[body.n_inputs :, 0] = setting.gate
        physics.body, physics.w_out = body, readout
        return physics

    def step(self, n_sub_steps: int = 1) -> None:
        """As dm_control's; a blow-up is remembered, with the last good state, not raised."""
        before = self.get_state()
        try:
            super().step(n_sub_steps)
            self.forward()  # the step leaves the lengths of its start
        except control.PhysicsError:
            self.blew_up = True
            self.set_state(before)
            with self.suppress_physics_errors():
                self.forward()

    def lengths(self) -> Array:
        """Spring lengths (L,) now [m]."""
        found: Array = self.data.sensordata[: self.body.n_springs].copy()
        return found

    def outputs(self) -> Array:
        """What the readout says now (n_outputs,)."""
        return Readout.from_rows(self.w_out, self.body.n_springs).outputs(self.lengths())


class Orbit(base.Task):
    """Generate a target's orbit; the agent acts on input channels and fed-back outputs.

    Reward in [0, 1] from the orbit error of the last period (metrics.orbit_window). It says where
    the outputs are, not how fast they go round.

    Args:
        target: the orbit; its value at each moment is observed too.
        setting: what the agent may do.
        inputs: (n_inputs,) that the agent's are added to.
        first: an episode's start; None: rest.
        random: a seed or a RandomState, for the kick.
    """

    def __init__(
        self,
        body: Body,
        target: Target,
        setting: Setting,
        inputs: Array,
        first: State | None = None,
        random: int | np.random.RandomState = 0,
    ) -> None:
        super().__init__(random=random)
        self.target, self.setting = target, setting
        self._first = first
        self._held = np.concatenate([inputs, np.zeros(body.n_outputs)])
        limits = setting.limits(body)
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
        install.install(passive=self.setting.passive)  # another package may have taken them out
        free = physics.body.free
        velocities = self.setting.kick * self.random.standard_normal(
            (len(free), physics.body.dimensions)
        )
        if self._first is not None:
            physics.data.time = self._first.time
            moved = self._first.positions - physics.body.positions
            physics.data.qpos[:] = moved[free].ravel()
            velocities += self._first.velocities[free]
        physics.data.qvel[:] = velocities.ravel()
        physics.blew_up = False
        self._window.clear()
        super().initialize_episode(physics)

    def before_step(self, action: Array, physics: Physics) -> None:
        """Actions beyond their bounds are clipped."""
        physics.data.ctrl[:] = self._held
        physics.data.ctrl[self._channels] += np.clip(action, -self._limits, self._limits)

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
    *,
    inputs: object = None,
) -> Environment:
    """An environment of a body with its readout.

    Args:
        w_out: (L or L + 1, n_outputs).
        random: a seed or a RandomState; the same seed gives the same episodes.
        inputs: (n_inputs,) held all the time, that the agent's are added to; default: 0.

    Raises:
        InvalidArgumentError: a readout, target, input or setting that does not fit the body.
    """
    setting = setting or Setting()
    if body.n_outputs != target.n_outputs:
        raise InvalidArgumentError("body", f"{target.n_outputs} outputs", body.n_outputs)
    constant = np.zeros(body.n_inputs) if inputs is None else inputs
    held = as_array("inputs", constant, (body.n_inputs,))
    options = Options(setting.timestep, setting.integrator)
    warn_if_unstable(body, options)
    first = state_on_cycle(body, target, held, options) if setting.start == "cycle" else None
    return Environment(
        Physics.of_body(body, w_out, setting),
        Orbit(body, target, setting, held, first, random),
        time_limit=setting.time_limit,
        control_timestep=setting.control_timestep,
        legacy_step=False,  # whole steps: a step knows its action from its start
    )


def load(
    name: str,
    task: str | None = None,
    setting: Setting | None = None,
    random: int | np.random.RandomState = 0,
) -> Environment:
    """The environment of a body by its name, or of a body file, in the manner of the suite.

    Args:
        name, task: as for `mcmj.learning.environments.tasks.assign`.
        setting, random: as for `make`.

    Raises:
        UnknownNameError: no such body or task.
    """
    given = assign(name, task, setting)
    return make(given.body, given.w_out, given.target, setting, random, inputs=given.inputs)


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
