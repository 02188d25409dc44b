"""What a rollout returns, whichever engine ran it."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mcmj.utils.errors import UnknownNameError
from mcmj.utils.validation import Array

TIME_AXIS = {
    "lengths": -2, "outputs": -2, "positions": -3, "velocities": -3, "qpos": -2, "qvel": -2,
    "sensordata": -2,
}  # fmt: skip
RECORDABLE = tuple(TIME_AXIS)


@dataclass(frozen=True)
class State:
    """Where the nodes are and how fast they move; what an engine needs to go on.

    Attributes:
        positions, velocities: (N, D) [m], [m/s], D = 2 or 3.
        time: [s].
        previous_lengths: (L,) spring lengths one step earlier [m] (toolbox scheme only).
        pending_output: (n_outputs,) output still to be fed back (toolbox scheme only).
        history: (N, 3 D + 1), the reference's leapfrogs only: `velocities` again, the velocities
            that dampers see next and those half a step back [m/s], the last push [N]. Whoever
            changes `velocities` makes it void: the scheme then starts anew from them.
    """

    positions: Array
    velocities: Array
    time: float = 0.0
    previous_lengths: Array | None = None
    pending_output: Array | None = None
    history: Array | None = None


@dataclass(frozen=True)
class Trajectory:
    """Samples of one rollout at the control steps t_k = t_0 + k * timestep.

    Everything at index k is the value at t_k, before step k: lengths[k] are what the readout
    sees at t_k, and outputs[k] = W_out^T lengths[k]. What was not recorded is None. An
    ensemble's arrays have one more axis in front, its copies.

    Attributes:
        times: (T,) [s].
        lengths: (T, L) spring lengths [m]; of any other model the signals (T, n_signals).
        outputs: (T, n_outputs), zeros without a readout.
        positions, velocities: (T, N, D) [m], [m/s].
        qpos, qvel: (T, nq), (T, nv) of a model that is no Body.
        sensordata: (T, nsensordata) all sensors of such a model, as MuJoCo computed them in step k.
        final_state: state after the last step.
    """

    times: Array
    lengths: Array | None = None
    outputs: Array | None = None
    positions: Array | None = None
    velocities: Array | None = None
    qpos: Array | None = None
    qvel: Array | None = None
    sensordata: Array | None = None
    final_state: State | None = field(default=None, repr=False)

    def __len__(self) -> int:
        return len(self.times)

    def thinned(self, every: int) -> "Trajectory":
        """The first of every so many samples."""
        rows = np.arange(0, len(self), every)
        kept: dict[str, Any] = {
            name: np.take(getattr(self, name), rows, axis)
            for name, axis in TIME_AXIS.items()
            if getattr(self, name) is not None
        }
        return replace(self, times=self.times[rows], **kept)

    @property
    def signals(self) -> Array | None:
        """What the readout hears: (T, n_signals), the lengths of a body."""
        return self.lengths

    def get(self, name: str) -> Array:
        """A recorded array.

        Raises:
            UnknownNameError: it was not recorded.
        """
        name = "lengths" if name == "signals" else name
        array: Array | None = getattr(self, name) if name in TIME_AXIS else None
        if array is None:
            recorded = [n for n in TIME_AXIS if getattr(self, n) is not None]
            raise UnknownNameError("recorded array", name, recorded)
        return array


def join(parts: Sequence[Trajectory]) -> Trajectory:
    """One trajectory from consecutive ones."""

    def whole(name: str) -> Array | None:
        pieces = [getattr(part, name) for part in parts]
        return None if pieces[0] is None else np.concatenate(pieces, axis=TIME_AXIS[name])

    if len(parts) == 1:
        return parts[0]
    return Trajectory(
        times=np.concatenate([part.times for part in parts]),
        final_state=parts[-1].final_state,
        **{name: whole(name) for name in TIME_AXIS},
    )
