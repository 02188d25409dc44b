"""How a robot walks: falls, distance, cost of transport, and how ground and body keep step."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from mcmj.metrics import gaits, orbits
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array

UPRIGHT = 0.5  # cosine of the tilt beyond which a robot has fallen
LOW = 0.5  # height of the trunk's middle, in leg lengths, below which it has


@dataclass(frozen=True, eq=False)
class Walk:
    """Samples of a walk; arrays have the copies as their first axis.

    Attributes:
        times: (T,) since the walk's start [s].
        trunk: (copies, T, 7) position [m] and orientation (quaternion) of the trunk.
        outputs: (copies, T, n_legs) x_i.
        contact: (copies, T, n_legs) force of the ground on each foot [N].
        power: (copies, T) positive mechanical power of all servos [W].
        net: (copies, T) the same, what they take back taken off.
        joints: (copies, T, nq) all of MuJoCo's qpos, if asked for.
    """

    times: Array
    trunk: Array
    outputs: Array
    contact: Array
    power: Array
    net: Array
    joints: Array | None = None

    @property
    def sample(self) -> float:
        """Time between samples [s]."""
        return float(self.times[1] - self.times[0])

    def after(self, time: float) -> "Walk":
        """The samples later than a time [s].

        Raises:
            InvalidArgumentError: fewer than two are.
        """
        first = int(np.searchsorted(self.times, time, side="right"))
        if len(self.times) - first < 2:
            raise InvalidArgumentError("time", f"less than {self.times[-1]:g} s", time)
        joints = None if self.joints is None else self.joints[:, first:]
        return Walk(
            self.times[first:], self.trunk[:, first:], self.outputs[:, first:],
            self.contact[:, first:], self.power[:, first:], self.net[:, first:], joints,
        )  # fmt: skip


def joined(parts: Sequence[Walk]) -> Walk:
    """One walk from consecutive ones of the same sampling."""
    step = parts[0].sample
    fields = ("trunk", "outputs", "contact", "power", "net", "joints")
    arrays: dict[str, Any] = {}
    for name in fields:
        pieces = [getattr(part, name) for part in parts]
        arrays[name] = None if pieces[0] is None else np.concatenate(pieces, axis=1)
    count = sum(len(part.times) for part in parts)
    return Walk(parts[0].times[0] + step * np.arange(count, dtype=np.float64), **arrays)


def fallen(trunk: Array, leg: float, slope: float = 0.0) -> npt.NDArray[np.bool_]:
    """Whether a robot has fallen, by the pose (..., 7) of its trunk.

    It has when the trunk is tilted by more than 60 degrees from the ground's normal, or its
    middle is lower than half a leg's length.

    Args:
        leg: length of a leg [m].
        slope: of the ground [rad].
    """
    normal = np.array([-np.sin(slope), 0.0, np.cos(slope)])
    w, x, y, z = np.moveaxis(trunk[..., 3:], -1, 0)
    up = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x**2 + y**2)], axis=-1)
    found: npt.NDArray[np.bool_] = (up @ normal < UPRIGHT) | (trunk[..., :3] @ normal < LOW * leg)
    return found


def fall_times(walk: Walk, leg: float, slope: float = 0.0) -> Array:
    """When each copy falls (copies,) [s]; infinite if it does not. See `fallen`."""
    fell = fallen(walk.trunk, leg, slope)
    return np.where(fell.any(axis=1), walk.times[fell.argmax(axis=1)], np.inf)


def distances(walk: Walk) -> Array:
    """Distance (copies,) [m] as the crow flies, from the first sample to the last."""
    found: Array = np.linalg.norm(walk.trunk[:, -1, :3] - walk.trunk[:, 0, :3], axis=-1)
    return found


def speeds(walk: Walk) -> Array:
    """Distance over time (copies,) [m/s]."""
    found: Array = distances(walk) / (walk.times[-1] - walk.times[0])
    return found


def costs_of_transport(walk: Walk, weight: float) -> Array:
    """Positive mechanical work of the servos over weight [N] times distance (copies,)."""
    work = walk.power[:, 1:].sum(axis=1) * walk.sample
    found: Array = work / (weight * np.maximum(distances(walk), 1e-9))
    return found


def headings(trunk: Array) -> Array:
    """Angles (.., T) [rad] of the trunk's x axis in the ground's plane, by its poses (.., T, 7)."""
    w, x, y, z = np.moveaxis(trunk[..., 3:], -1, 0)
    found: Array = np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y**2 + z**2)), axis=-1)
    return found


def way_ahead(walk: Walk) -> Array:
    """Distance (copies,) [m] along the heading, which may turn; negative backwards."""
    heading = headings(walk.trunk)[:, :-1]
    steps = np.diff(walk.trunk[..., :2], axis=1)
    found: Array = (steps[..., 0] * np.cos(heading) + steps[..., 1] * np.sin(heading)).sum(axis=1)
    return found


def turns(walk: Walk) -> Array:
    """By how much the heading changes (copies,) [rad], left positive."""
    heading = headings(walk.trunk)
    found: Array = heading[:, -1] - heading[:, 0]
    return found


def stride_period(walk: Walk, guess: float, copy: int = 0) -> float:
    """Mean period of the outputs [s], NaN if they do not repeat."""
    return orbits.period(walk.outputs[copy], walk.sample, guess)


def ground_lags(walk: Walk, period: float, copy: int = 0) -> Array:
    """By how much each foot's load lags behind its output (n,), in periods from 0 to 1.

    From the fundamentals (gaitmetrics.phase_lags): the phase between the body's rhythm and
    the ground.
    """
    pairs = zip(walk.outputs[copy].T, walk.contact[copy].T, strict=True)
    return np.array(
        [gaits.phase_lags(np.column_stack(pair), walk.sample, period)[1] for pair in pairs]
    )


def phase_shift(walk: Walk, period: float, copy: int, reference: int = 0) -> float:
    """How far a copy's rhythm is ahead of another's at the end, in periods, within +-1/2."""
    both = np.column_stack([walk.outputs[copy][:, 0], walk.outputs[reference][:, 0]])
    lag = gaits.phase_lags(both, walk.sample, period)[1]
    return float(np.mod(lag + 0.5, 1.0) - 0.5)
