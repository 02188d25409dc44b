"""Bodies, and any other reservoirs, as dm_control environments; needs the extra "control".

The physics is dm_control's own Physics of the model, with mcmj's compiled callbacks installed: the
feedback loop runs inside MuJoCo, and the agent acts beside it. The only module that imports
dm_control.
"""

from collections import OrderedDict
from collections.abc import Sequence
from typing import Any

import mujoco as mj
import numpy as np

from mcmj.learning.environments.setting import Setting
from mcmj.learning.environments.tasks import all_tasks as all_tasks
from mcmj.learning.environments.tasks import assign, states_on_cycle
from mcmj.metrics.motion_error import MotionError
from mcmj.simulation.reservoir import Reservoir
from mcmj.simulation.simulation import Simulation
from mcmj.targets.limit_cycles import Target
from mcmj.targets.named import require_outputs
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.extras import extra
from mcmj.utils.validation import Array, as_array

with extra("control", "environments need dm_control"):
    from dm_control import mujoco
    from dm_control.mujoco import wrapper
    from dm_control.rl import control
    from dm_control.suite import base
    from dm_env import specs

RUNAWAY_LENGTH, RUNAWAY_OUTPUT = 10.0, 100.0  # of a body's size and the target's


class Physics(mujoco.Physics):
    """dm_control's Physics of one reservoir, and what its readout says."""

    reservoir: Reservoir
    blew_up = False  # in this episode

    @classmethod
    def of_reservoir(cls, reservoir: Reservoir, gate: float) -> "Physics":
        """The model with its readout and its feedback gate."""
        engine = reservoir.in_mujoco
        engine.install()
        model, outputs = engine.batch.get_model(0), engine.channels.outputs
        rows = reservoir.readout.rows
        model.actuator_user[outputs, : len(rows)] = rows.T
        model.actuator_biasprm[outputs, 0] = gate
        physics: Physics = cls.from_model(wrapper.MjModel(model))
        physics.reservoir = reservoir
        return physics

    def step(self, n_sub_steps: int = 1) -> None:
        """As dm_control's; a blow-up is remembered, with the last good state, not raised."""
        before = self.get_state()
        try:
            super().step(n_sub_steps)
        except control.PhysicsError:
            self.blew_up = True
            self.set_state(before)
        self.sense()

    def sense(self) -> None:
        """Sensors of the state as it is: a step leaves those of its start."""
        model, data = self.model.ptr, self.data.ptr
        mj.mj_fwdPosition(model, data)
        mj.mj_sensorPos(model, data)
        mj.mj_sensorVel(model, data)

    def signals(self) -> Array:
        """What the readout hears now (n_signals,)."""
        found: Array = self.data.sensordata[self.reservoir.in_mujoco.channels.signals].copy()
        return found

    def outputs(self) -> Array:
        """What the readout says now (n_outputs,)."""
        return self.reservoir.readout.outputs(self.signals())


class Orbit(base.Task):
    """Generate a target's orbit at its pace; the agent acts on inputs and fed-back outputs.

    The reward of a control step is in [0, 1]:

        reward = 0.1^(e^2 / margin^2)

    e is the distance of the outputs' place and velocity, over the step, to the nearest point of
    the target's motion (metrics.motion_error): 1 on the orbit at its pace, whatever the phase;
    at most 0.1^(1 / margin^2) for outputs that stand still, 1e-4 with the default margin.

    Args:
        reservoir: with its readout.
        target: the orbit; its value at each moment is observed too.
        setting: what the agent may do.
        inputs: (n_inputs,) that the agent's are added to.
        starts: MuJoCo's integration states, one of which an episode starts from; none: the
            model's own start.
        random: a seed or a RandomState, for start and kick.
    """

    def __init__(
        self,
        reservoir: Reservoir,
        target: Target,
        setting: Setting,
        inputs: Array,
        starts: Sequence[Array] = (),
        random: int | np.random.RandomState = 0,
    ) -> None:
        super().__init__(random=random)
        self.target, self.setting, self._starts = target, setting, starts
        self._install = reservoir.in_mujoco.install
        at = reservoir.in_mujoco.channels
        self._held = np.zeros(reservoir.model.nu)
        self._held[at.inputs] = inputs
        sizes = np.zeros(reservoir.model.nu)
        largest = float(np.abs(target.orbit(4096)).max())
        sizes[at.inputs], sizes[at.outputs] = setting.limits(largest)
        self._acted = [c for part in (at.inputs, at.outputs) for c in range(part.start, part.stop)]
        self._acted = [c for c in self._acted if sizes[c] > 0]
        self._limits = sizes[self._acted]
        if not self._acted:
            raise InvalidArgumentError("actions", "channels that the body has", setting.actions)
        self._motion = MotionError(target, setting.control_timestep)
        self._before = np.zeros(target.n_outputs)
        self._bounds = _observation_bounds(reservoir, target)

    def reseed(self, seed: int) -> None:
        """Start the task's random numbers anew."""
        self.random.seed(seed)

    def initialize_episode(self, physics: Physics) -> None:
        """The model's start or a random point of the cycle, kicked."""
        self._install()  # another package may have taken the callbacks out
        kick = self.setting.kick * self.random.standard_normal(physics.model.nv)
        if self._starts:
            first = self._starts[self.random.randint(len(self._starts))]
            spec = mj.mjtState.mjSTATE_INTEGRATION.value
            mj.mj_setState(physics.model.ptr, physics.data.ptr, first, spec)
        physics.data.qvel[:] += kick
        physics.sense()
        physics.blew_up = False
        super().initialize_episode(physics)

    def before_step(self, action: Array, physics: Physics) -> None:
        """Actions beyond their bounds are clipped."""
        self._before = physics.outputs()
        physics.data.ctrl[:] = self._held
        physics.data.ctrl[self._acted] += np.clip(action, -self._limits, self._limits)

    def action_spec(self, physics: Physics) -> specs.BoundedArray:
        """Inputs [units of the channel], then offsets [units of the outputs]."""
        return specs.BoundedArray(
            self._limits.shape, np.float64, -self._limits, self._limits, name="action"
        )

    def get_observation(self, physics: Physics) -> OrderedDict[str, Array]:
        """Signals, outputs, and the target's value now, clipped at their bounds."""
        values = {
            "signals": physics.signals(),
            "outputs": physics.outputs(),
            "target": self.target.sample([physics.time()])[0],
        }
        return OrderedDict((name, np.clip(values[name], *self._bounds[name])) for name in values)

    def observation_spec(self, physics: Physics) -> OrderedDict[str, specs.BoundedArray]:
        """Lengths of a body to 10 times its size, outputs to 100 times the target's."""
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
        """As the class says; 0 if the body blew up."""
        if physics.blew_up:
            return 0.0
        error = self._motion.of(physics.outputs(), self._before)
        return float(0.1 ** (error / self.setting.margin) ** 2)


class Environment(control.Environment):
    """dm_control's Environment with a bounded reward."""

    def reward_spec(self) -> specs.BoundedArray:
        """In [0, 1]."""
        return specs.BoundedArray((), float, 0.0, 1.0, name="reward")


def make(
    reservoir: Reservoir,
    target: Target,
    setting: Setting | None = None,
    random: int | np.random.RandomState = 0,
    *,
    inputs: object = None,
) -> Environment:
    """An environment of a body or any other reservoir with its readout.

    Args:
        reservoir: a Simulation or Reservoir; it is not changed.
        random: a seed or a RandomState; the same seed gives the same episodes.
        inputs: (n_inputs,) held all the time, that the agent's are added to; default: 0.

    Raises:
        InvalidArgumentError: a target, input or setting that does not fit the reservoir.
    """
    setting = setting or Setting()
    if isinstance(reservoir, Simulation):
        reservoir = reservoir.with_tendons()  # springs that are seen
    require_outputs(reservoir, target, "reservoir")
    setting.check_step(reservoir.timestep)
    constant = np.zeros(reservoir.n_inputs) if inputs is None else inputs
    held = as_array("inputs", constant, (reservoir.n_inputs,))
    starts = states_on_cycle(reservoir, target, held) if setting.start == "cycle" else ()
    return Environment(
        Physics.of_reservoir(reservoir, setting.gate),
        Orbit(reservoir, target, setting, held, starts, random),
        time_limit=setting.time_limit,
        control_timestep=setting.control_timestep,
        legacy_step=False,  # whole steps: a step knows its action from its start
    )


def load(
    name: str,
    task: str | None = None,
    setting: Setting | None = None,
    random: int | np.random.RandomState = 0,
    **stepping: Any,
) -> Environment:
    """The environment of a body by its name, or of a body file, in the manner of the suite.

    Args:
        name, task: as for `mcmj.learning.environments.tasks.assign`.
        setting, random: as for `make`.
        stepping: timestep, integrator: as for Simulation.

    Raises:
        UnknownNameError: no such body or task.
    """
    given = assign(name, task, **stepping)
    return make(given.simulation, given.target, setting, random, inputs=given.inputs)


def _observation_bounds(reservoir: Reservoir, wanted: Target) -> dict[str, tuple[Array, Array]]:
    orbit = wanted.orbit(4096)
    low, high = orbit.min(axis=0), orbit.max(axis=0)
    slack = 1e-3 * (high - low)  # between the orbit's points
    least, longest = np.full(reservoir.n_signals, -np.inf), np.full(reservoir.n_signals, np.inf)
    if isinstance(reservoir, Simulation):
        least[:] = 0.0
        longest[:] = RUNAWAY_LENGTH * np.ptp(reservoir.body.positions, axis=0).max()
    largest = np.full(reservoir.n_outputs, RUNAWAY_OUTPUT * np.abs(orbit).max())
    return {
        "signals": (least, longest),
        "outputs": (-largest, largest),
        "target": (low - slack, high + slack),
    }
