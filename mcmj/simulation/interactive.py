"""A reservoir in closed loop that one may disturb at any moment: what the viewer steps.

MuJoCo's own model and data, with mcmj's callbacks installed; no window here.
"""

from collections.abc import Mapping

import mujoco
import numpy as np

from mcmj.core.readout import Readout
from mcmj.simulation.reservoir import Reservoir
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.quiet import quiet_warnings
from mcmj.utils.validation import MOST_STEPS, Array, require_count, require_number

_STATE = mujoco.mjtState.mjSTATE_INTEGRATION.value


class LiveLoop:
    """A body or model with one or more readouts; the loop is closed by the first.

    Args:
        reservoir: where it is now the loop starts, and starts again; it is not changed.
        readouts: by name, (n_signals or n_signals + 1, n_outputs) each.

    Raises:
        InvalidArgumentError: no readout, or one that does not fit.
    """

    def __init__(self, reservoir: Reservoir, readouts: Mapping[str, Array]) -> None:
        if not readouts:
            raise InvalidArgumentError("readouts", "at least one", "none")
        self.reservoir, self._engine = reservoir, reservoir.in_mujoco
        n_signals, n_outputs = reservoir.n_signals, reservoir.n_outputs
        self._readouts = {
            name: Readout.of(value, n_signals, n_outputs, name) for name, value in readouts.items()
        }
        self.model = self._engine.batch.get_model(0)
        self.data = mujoco.MjData(self.model)
        self.timestep = float(self.model.opt.timestep)
        self._start = self._engine.batch.state[0].copy()
        self._outputs_at = self._engine.channels.outputs
        self.switch(next(iter(self._readouts)))
        self.reset()

    @property
    def time(self) -> float:
        """Since the start of the simulation [s]."""
        return float(self.data.time)

    @property
    def readout_names(self) -> list[str]:
        """Of all readouts, in their order."""
        return list(self._readouts)

    @property
    def outputs(self) -> Array:
        """What is fed back now (n_outputs,): the readout's outputs, or their frozen values."""
        self._engine.install()  # which measures a body's lengths
        with quiet_warnings():
            mujoco.mj_fwdPosition(self.model, self.data)
            mujoco.mj_sensorPos(self.model, self.data)
            mujoco.mj_sensorVel(self.model, self.data)
        signals = self.data.sensordata[self._engine.channels.signals]
        now = self._readouts[self.readout].outputs(signals)
        return np.where(self.frozen, self.data.ctrl[self._outputs_at], now)

    @property
    def alive(self) -> bool:
        """Whether all numbers are finite still."""
        return bool(np.isfinite(self.data.qpos).all() and np.isfinite(self.data.qvel).all())

    def reset(self) -> None:
        """Back to the start, nothing frozen; the readout stays."""
        mujoco.mj_resetData(self.model, self.data)
        mujoco.mj_setState(self.model, self.data, self._start, _STATE)
        self.data.ctrl[:] = 0.0
        self.frozen = np.zeros(self.reservoir.n_outputs, dtype=bool)
        self.model.actuator_biasprm[self._outputs_at, 0] = 1.0

    def advance(self, steps: int, pushes: Array | None = None) -> None:
        """Do steps, with constant forces and torques (n_bodies, 6) on the bodies [N], [N m]."""
        require_count("steps", steps, 1, MOST_STEPS)
        self._engine.install()
        self.data.xfrc_applied[:] = 0.0 if pushes is None else pushes
        with quiet_warnings():
            mujoco.mj_step(self.model, self.data, nstep=steps)

    def freeze(self, channel: int) -> None:
        """Hold an output at its present value, or let it go again.

        Raises:
            InvalidArgumentError: no such output.
        """
        n_outputs = self.reservoir.n_outputs
        if not 0 <= channel < n_outputs:
            raise InvalidArgumentError("channel", f"0 to {n_outputs - 1}", channel)
        actuator = self._outputs_at.start + channel
        held = 0.0 if self.frozen[channel] else self.outputs[channel]
        self.data.ctrl[actuator] = held
        self.frozen[channel] = not self.frozen[channel]
        self.model.actuator_biasprm[actuator, 0] = float(not self.frozen[channel])

    def kick(self, speed: float, draw: np.random.Generator) -> None:
        """Add random velocities of this standard deviation, MuJoCo's units, to all joints."""
        require_number("speed", speed, 0.0)
        self._engine.start_anew(self.data)
        self.data.qvel[:] += speed * draw.standard_normal(self.data.qvel.shape)

    def switch(self, name: str) -> None:
        """Close the loop by another readout.

        Raises:
            UnknownNameError: no such readout.
        """
        if name not in self._readouts:
            raise UnknownNameError("readout", name, self._readouts)
        self.readout = name
        rows = self._readouts[name].rows
        self.model.actuator_user[self._outputs_at, : len(rows)] = rows.T

    def switch_next(self) -> None:
        """Close the loop by the next readout, the first after the last."""
        names = self.readout_names
        self.switch(names[(names.index(self.readout) + 1) % len(names)])
