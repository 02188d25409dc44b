"""Gaits as targets: four coupled oscillators, one a leg (Righetti and Ijspeert, ICRA 2008).

    x_i' = alpha (mu - r_i^2) x_i - omega_i y_i,      r_i^2 = x_i^2 + y_i^2
    y_i' = beta (mu - r_i^2) y_i + omega_i x_i + sum_j k_ij y_j
    omega_i = stance / (exp(-b y_i) + 1) + swing / (exp(b y_i) + 1)

The coupling decides in which order the legs step, `stance` and `swing` how long a leg is in
either: where y_i > 0 it is in stance and turns with the first frequency, else with the second.
On the limit cycle r_i is near 1, hence x_i' near -omega_i y_i: x_i, the leg's position, falls in
stance (the foot is carried backwards) and rises in swing. The signal is x_1 .. x_4.
"""

import functools
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from scipy.special import expit

from mcmj.targets.limit_cycles import Target, from_array, limit_cycle
from mcmj.utils.errors import UnknownNameError
from mcmj.utils.validation import Array, as_array, require_number

LEGS = ("LF", "RF", "LH", "RH")  # left and right, fore and hind
ALPHA, BETA, MU, SHARPNESS = 5.0, 50.0, 1.0, 50.0
LONGEST_PERIOD = 12.0  # s
POINTS = 8192  # knots of the spline through a cycle: off by some 1e-11


@dataclass(frozen=True)
class Gait:
    """A gait of four legs, in the order of LEGS.

    Attributes:
        name: for figures and files.
        coupling: (4, 4), k_ij of leg j on leg i.
        stance: angular frequency in stance [rad/s].
        swing: angular frequency in swing [rad/s].
        lags: (4,) phase lags behind LF, in periods, from which the oscillators start.
        transient: time they get to reach the limit cycle [s].

    Raises:
        InvalidArgumentError: wrong shape, NaN, or a number out of bounds.
    """

    name: str
    coupling: Sequence[Sequence[float]]
    stance: float
    swing: float
    lags: Sequence[float]
    transient: float = 20.0

    def __post_init__(self) -> None:
        as_array("coupling", self.coupling, (4, 4))
        as_array("lags", self.lags, (4,))
        for name in ("stance", "swing", "transient"):
            require_number(name, getattr(self, name), 0.0, open_low=True)

    def rhs(self, t: float, state: Array) -> Array:
        """Time derivative of (x_1 .. x_4, y_1 .. y_4); overflows for no y."""
        x, y = state[:4], state[4:]
        in_stance = expit(SHARPNESS * y)  # 1 / (exp(-b y) + 1)
        omega = self.swing + (self.stance - self.swing) * in_stance
        inward = MU - x * x - y * y
        pull = np.asarray(self.coupling) @ y
        return np.concatenate(
            [ALPHA * inward * x - omega * y, BETA * inward * y + omega * x + pull]
        )

    def target(self) -> Target:
        """x_1 .. x_4 on the limit cycle, by DOP853.

        Raises:
            McmjError: the oscillators settle on no limit cycle.
        """
        angles = -2 * np.pi * np.asarray(self.lags)
        cycle = limit_cycle(
            self.name,
            self.rhs,
            np.concatenate([np.cos(angles), np.sin(angles)]),
            transient=self.transient,
            longest_period=LONGEST_PERIOD,
            observe=lambda states: states[:, :4],
            kept=asdict(self),
        )
        # a spline is sampled far faster than the integrator's polynomials
        return from_array(self.name, cycle.orbit(POINTS), cycle.period / POINTS)


GAITS: dict[str, Gait] = {
    gait.name: gait
    for gait in (
        Gait(  # a lateral sequence, LH LF RH RF; it settles slowly
            "walk", ((0, -1, 1, -1), (-1, 0, -1, 1), (-1, 1, 0, -1), (1, -1, -1, 0)),
            stance=0.6, swing=1.8, lags=(0.0, 0.5, 0.75, 0.25), transient=200.0,
        ),
        Gait(
            "trot", ((0, -1, -1, 1), (-1, 0, 1, -1), (-1, 1, 0, -1), (1, -1, -1, 0)),
            stance=1.4, swing=1.6, lags=(0.0, 0.5, 0.5, 0.0),
        ),
        Gait(
            "pace", ((0, -1, 1, -1), (-1, 0, -1, 1), (1, -1, 0, -1), (-1, 1, -1, 0)),
            stance=1.5, swing=1.7, lags=(0.0, 0.5, 0.0, 0.5),
        ),
        Gait(
            "bound", ((0, 1, -1, -1), (1, 0, -1, -1), (-1, -1, 0, 1), (-1, -1, 1, 0)),
            stance=1.8, swing=1.6, lags=(0.0, 0.0, 0.5, 0.5),
        ),
    )
}  # fmt: skip


@functools.cache
def gait_target(name: str) -> Target:
    """The target of one of GAITS; integrated once a process.

    Raises:
        UnknownNameError: no such gait.
    """
    if name not in GAITS:
        raise UnknownNameError("gait", name, GAITS)
    return GAITS[name].target()
