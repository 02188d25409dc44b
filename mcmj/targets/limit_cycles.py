"""What a body is taught: limit cycles from an accurate integrator, closed curves, arrays."""

import functools
import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from mcmj.targets.dense_output import DenseOutput
from mcmj.targets.kept_arrays import kept_arrays
from mcmj.utils.errors import InvalidArgumentError, McmjError, UnknownNameError
from mcmj.utils.validation import MOST_STEPS, Array, as_array, require_count, require_number

RTOL, ATOL = 1e-10, 1e-12  # a target must be far more exact than any readout


@dataclass(frozen=True)
class Target:
    """A periodic signal y*(t) = curve(t mod period) in the plane or higher.

    Attributes:
        name: for figures and files.
        period: [s].
        curve: function of times (T,) in [0, period] -> (T, n_outputs).
        rhs: of the autonomous system x' = rhs(t, x) whose limit cycle it is, if it is one and
            the signal is its whole state.
    """

    name: str
    period: float
    curve: Callable[[Array], Array] = field(repr=False)
    rhs: Callable[[float, Array], Array] | None = field(default=None, repr=False)
    _orbits: dict[int, Array] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        require_number("period", self.period, 0.0, open_low=True)
        ends = as_array("curve", self.curve(np.array([0.0, self.period])), (2, None))
        size = np.abs(self.orbit(64)).max()
        if np.abs(ends[1] - ends[0]).max() > 1e-6 * size:
            raise InvalidArgumentError(
                "curve", f"a closed curve of period {self.period:g}", f"{ends[0]} != {ends[1]}"
            )

    @property
    def n_outputs(self) -> int:
        """Dimension of the signal."""
        return int(self.curve(np.zeros(1)).shape[1])

    def sample(self, times: npt.ArrayLike) -> Array:
        """y* (T, n_outputs) at times (T,) [s]."""
        return self.curve(np.mod(np.asarray(times, dtype=np.float64), self.period))

    def faster(self, pace: float) -> "Target":
        """The same orbit, run through `pace` times as fast: y*(pace t).

        Raises:
            InvalidArgumentError: a pace that is not positive.
        """
        require_number("pace", pace, 0.0, open_low=True)
        curve, rhs = self.curve, self.rhs
        return Target(
            self.name,
            self.period / pace,
            lambda times: curve(pace * np.asarray(times, dtype=np.float64)),
            None if rhs is None else lambda t, x: pace * np.asarray(rhs(pace * t, x)),
        )

    def orbit(self, points: int) -> Array:
        """One period as a closed polygon (points, n_outputs), equally spaced in time; read only."""
        if points not in self._orbits:
            found = self.sample(np.arange(points) * (self.period / points))
            found.flags.writeable = False
            self._orbits[points] = found
        return self._orbits[points]


def limit_cycle(
    name: str,
    rhs: Callable[[float, Array], Array],
    start: npt.ArrayLike,
    *,
    transient: float = 100.0,
    longest_period: float = 100.0,
    observe: Callable[[Array], Array] | None = None,
    kept: object = None,
) -> Target:
    """The limit cycle that x' = rhs(t, x) reaches from a start, by DOP853.

    The period is the time between two passages, in the same direction, of the plane through
    x(transient) at right angles to the flow, at the same place.

    Args:
        rhs: autonomous right-hand side.
        start: x(0), (n,).
        transient: time to reach the cycle [s].
        longest_period: give up looking for a return after this time [s].
        observe: function of states (T, n) -> the signal (T, n_outputs); default: the states.
        kept: all that `rhs` depends on besides the code of mcmj.targets, as JSON types; with it
            the cycle is kept on the disk (mcmj.targets.kept_arrays).

    Raises:
        McmjError: no cycle is reached: the system rests, diverges or does not come back.
    """
    origin = np.asarray(start, dtype=np.float64)

    def find() -> dict[str, Array]:
        period, states = _first_return(name, rhs, origin, transient, longest_period)
        return {"period": np.array(period), **states.arrays}

    if kept is None:
        found = find()
    else:
        asked = [name, kept, origin, transient, longest_period, RTOL, ATOL]
        found = kept_arrays("cycle", [asked, code_digest()], find)
    period, states = float(found["period"]), DenseOutput.from_arrays(found)
    if observe is None:
        return Target(name, period, states, rhs)
    return Target(name, period, lambda times: observe(states(times)))


def _first_return(
    name: str,
    rhs: Callable[[float, Array], Array],
    start: Array,
    transient: float,
    longest_period: float,
) -> tuple[float, DenseOutput]:
    """The period [s] of a limit cycle, and its states."""
    origin = integrate(rhs, start, transient).y[:, -1]
    flow = np.asarray(rhs(0.0, origin))
    if not np.isfinite(origin).all() or np.linalg.norm(flow) < 1e-9:
        raise McmjError(f"{name}: no limit cycle after {transient:g} s, x = {origin}")

    def section(t: float, x: Array) -> float:
        return float((x - origin) @ flow)

    section.direction = 1  # type: ignore[attr-defined]  # solve_ivp's way
    solution = integrate(rhs, origin, longest_period, events=section, dense_output=True)
    size = np.ptp(solution.y, axis=1).max()
    returns = [
        float(t)
        for t, x in zip(solution.t_events[0], solution.y_events[0], strict=True)
        if t > 1e-6 and np.abs(x - origin).max() < 1e-6 * size
    ]
    if not returns:
        raise McmjError(f"{name}: no return to x = {origin} within {longest_period:g} s")
    return returns[0], DenseOutput.of(solution).until(returns[0])


def from_array(name: str, values: npt.ArrayLike, timestep: float) -> Target:
    """A closed curve from samples (T, n_outputs) of one period, by a periodic cubic spline.

    Raises:
        InvalidArgumentError: fewer than 4 samples, wrong shape, or NaN.
    """
    samples = as_array("values", values, (None, None))
    require_count("number of samples", len(samples), 4, MOST_STEPS)
    require_number("timestep", timestep, 0.0, open_low=True)
    knots = np.arange(len(samples) + 1) * timestep
    spline = CubicSpline(knots, np.vstack([samples, samples[:1]]), bc_type="periodic")
    return Target(name, float(knots[-1]), spline)


def van_der_pol() -> Target:
    """x1' = x2, x2' = -x1 + (1 - x1^2) x2 (Hauser et al. 2012, Eq. 5)."""
    return limit_cycle(
        "van_der_pol",
        lambda t, x: np.array([x[1], -x[0] + (1 - x[0] ** 2) * x[1]]),
        [1.0, 0.0],
        kept=(),
    )


def quadratic(eps: float = 7.0) -> Target:
    """x1' = x1 + x2 - eps x1 r^2, x2' = -2 x1 + x2 - x2 r^2, r^2 = x1^2 + x2^2 (section 6.1)."""
    require_number("eps", eps, 0.0, open_low=True)
    return limit_cycle("quadratic", lambda t, x: quadratic_flow(x, eps), [0.1, 0.0], kept=eps)


def quadratic_flow(x: Array, eps: float) -> Array:
    """x' (2,) of the quadratic system at a state x (2,)."""
    r2 = x @ x
    return np.array([x[0] + x[1] - eps * x[0] * r2, -2 * x[0] + x[1] - x[1] * r2])


def lissajous() -> Target:
    """x1 = sin(t), x2 = sin(3 t / 2 + pi / 2): two sines with frequencies 2 : 3 (Fig. 5g)."""
    return Target(
        "lissajous",
        4 * np.pi,
        lambda t: np.column_stack([np.sin(t), np.sin(1.5 * t + np.pi / 2)]),
    )


TARGETS: dict[str, Callable[[], Target]] = {
    "van_der_pol": van_der_pol,
    "quadratic": quadratic,
    "lissajous": lissajous,
}


@functools.cache
def target(name: str) -> Target:
    """A target of the paper by its name; integrated once a process.

    Raises:
        UnknownNameError: no such target.
    """
    if name not in TARGETS:
        raise UnknownNameError("target", name, TARGETS)
    return TARGETS[name]()


@functools.cache
def code_digest() -> str:
    """Of what kept targets come from: the code of this folder, and the integrator's version."""
    digest = hashlib.sha256(f"{scipy.__version__} {np.__version__}".encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def integrate(
    rhs: Callable[[float, Array], Array], start: Array, duration: float, **options: Any
) -> Any:
    """solve_ivp's solution of x' = rhs(t, x) from x(0) by DOP853, as exact as targets are.

    Raises:
        McmjError: it cannot be integrated.
    """
    solution = solve_ivp(
        rhs, (0.0, duration), start, method="DOP853", rtol=RTOL, atol=ATOL, **options
    )
    if not solution.success:
        raise McmjError(f"the target system cannot be integrated: {solution.message}")
    return solution
