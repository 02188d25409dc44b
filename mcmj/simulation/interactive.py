"""A body in closed loop that one may disturb at any moment: what the viewer steps.

MuJoCo's own model and data, with mcmj's callback installed; no window here.
"""

from collections.abc import Mapping

import mujoco
import numpy as np

from mcmj.core.body import Body
from mcmj.core.callbacks import install
from mcmj.core.readout import Readout
from mcmj.core.trajectory import State
from mcmj.mjcf.read import load_model
from mcmj.mjcf.write import to_mjcf
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.quiet import quiet_warnings
from mcmj.utils.validation import MOST_STEPS, Array, require_count, require_number


class LiveLoop:
    """A body with one or more readouts; the loop is closed by the first.

    Args:
        readouts: by name, (L or L + 1, n_outputs) each.
        start: positions, velocities and time to start from; None: total rest.

    Raises:
        InvalidArgumentError: no readout, or one that does not fit.
    """

    def __init__(
        self,
        body: Body,
        readouts: Mapping[str, Array],
        *,
        start: State | None = None,
    ) -> None:
        if not readouts:
            raise InvalidArgumentError("readouts", "at least one", "none")
        self.body, self._start = body, start
        self._readouts = {
            name: Readout.of(value, body.n_springs, body.n_outputs, name)
            for name, value in readouts.items()
        }
        install.install()
        room = np.zeros((body.n_springs + 1, body.n_outputs))
        self._model = load_model(to_mjcf(body, w_out=room))
        self.timestep = float(self._model.opt.timestep)
        self._data = mujoco.MjData(self._model)
        self._feedback = slice(body.n_inputs, body.n_inputs + body.n_outputs)
        self._bodies = np.array([self._model.body(f"n{i}").id for i in body.free])
        self.switch(next(iter(self._readouts)))
        self.reset()

    @property
    def time(self) -> float:
        """Since the start of the simulation [s]."""
        return float(self._data.time)

    @property
    def readout_names(self) -> list[str]:
        """Of all readouts, in their order."""
        return list(self._readouts)

    @property
    def positions(self) -> Array:
        """Of the nodes now (N, D) [m]."""
        positions = self.body.positions.copy()
        positions[self.body.free] += self._data.qpos.reshape(-1, self.body.dimensions)
        return positions

    @property
    def outputs(self) -> Array:
        """What is fed back now (n_outputs,): the readout's outputs, or their frozen values."""
        with quiet_warnings():
            mujoco.mj_fwdPosition(self._model, self._data)
            mujoco.mj_sensorPos(self._model, self._data)
        now = self._readouts[self.readout].outputs(self._data.sensordata[: self.body.n_springs])
        return np.where(self.frozen, self._data.ctrl[self._feedback], now)

    @property
    def alive(self) -> bool:
        """Whether all numbers are finite still."""
        return bool(np.isfinite(self._data.qpos).all() and np.isfinite(self._data.qvel).all())

    def reset(self) -> None:
        """Back to the start, nothing frozen; the readout stays."""
        data = self._data
        mujoco.mj_resetData(self._model, data)
        self.frozen = np.zeros(self.body.n_outputs, dtype=bool)
        self._model.actuator_biasprm[self._feedback, 0] = 1.0
        if self._start is not None:
            free = self.body.free
            data.qpos[:] = (self._start.positions - self.body.positions)[free].ravel()
            data.qvel[:] = self._start.velocities[free].ravel()
            data.time = self._start.time

    def advance(self, steps: int, forces: Array | None = None) -> None:
        """Do steps, with constant forces (N, D) on the nodes [N]."""
        require_count("steps", steps, 1, MOST_STEPS)
        install.install()
        pushed = 0.0 if forces is None else forces[self.body.free]
        self._data.xfrc_applied[self._bodies, : self.body.dimensions] = pushed
        with quiet_warnings():
            mujoco.mj_step(self._model, self._data, nstep=steps)

    def freeze(self, channel: int) -> None:
        """Hold an output at its present value, or let it go again.

        Raises:
            InvalidArgumentError: no such output.
        """
        if not 0 <= channel < self.body.n_outputs:
            raise InvalidArgumentError("channel", f"0 to {self.body.n_outputs - 1}", channel)
        actuator = self.body.n_inputs + channel
        held = 0.0 if self.frozen[channel] else self.outputs[channel]
        self._data.ctrl[actuator] = held
        self.frozen[channel] = not self.frozen[channel]
        self._model.actuator_biasprm[actuator, 0] = float(not self.frozen[channel])

    def kick(self, speed: float, draw: np.random.Generator) -> None:
        """Add random velocities of this standard deviation [m/s] to all free nodes."""
        require_number("speed", speed, 0.0)
        self._data.qvel[:] += speed * draw.standard_normal(self._data.qvel.shape)

    def switch(self, name: str) -> None:
        """Close the loop by another readout.

        Raises:
            UnknownNameError: no such readout.
        """
        if name not in self._readouts:
            raise UnknownNameError("readout", name, self._readouts)
        self.readout = name
        self._model.actuator_user[self._feedback] = self._readouts[name].rows.T

    def switch_next(self) -> None:
        """Close the loop by the next readout, the first after the last."""
        names = self.readout_names
        self.switch(names[(names.index(self.readout) + 1) % len(names)])
