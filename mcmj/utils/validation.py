"""Checks at the boundary: arrays and numbers as the rest of the package expects them."""

from collections.abc import Collection, Sequence

import numpy as np
import numpy.typing as npt

from mcmj.utils.errors import InvalidArgumentError, UnknownNameError

MOST_COUNT = 10**6  # of anything that no other limit is given for
MOST_STEPS = 10**9  # of one run
LARGEST_SEED = 2**128 - 1  # as much as NumPy's own
SHORTEST_STEP = 1e-9  # s: below, rounding of the state exceeds what a step changes
Array = npt.NDArray[np.float64]


def as_array(name: str, value: object, shape: Sequence[int | None]) -> Array:
    """Return `value` as a finite, C-contiguous float64 array of the given shape.

    Args:
        name: the argument's name, for the error.
        value: anything NumPy can convert.
        shape: expected shape; None stands for any length along that axis.

    Raises:
        InvalidArgumentError: not numbers, another shape, or NaN or infinity inside.
    """
    wanted = "(" + ", ".join("any" if n is None else str(n) for n in shape) + ")"
    try:
        if np.iscomplexobj(np.asarray(value)):
            raise TypeError("complex")
        array = np.array(value, dtype=np.float64, order="C", copy=None)
    except (TypeError, ValueError) as error:
        raise InvalidArgumentError(name, f"numbers of shape {wanted}", repr(value)) from error
    if array.ndim != len(shape) or any(
        n is not None and n != m for n, m in zip(shape, array.shape, strict=True)
    ):
        raise InvalidArgumentError(name, f"shape {wanted}", f"shape {array.shape}")
    if not np.isfinite(array).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise InvalidArgumentError(name, "finite numbers", f"{array[where]} at index {where}")
    return array


def require_above(name: str, array: Array, low: float, *, strict: bool = True) -> None:
    """Raise unless every entry is > low (or >= low, if not strict)."""
    bad = np.flatnonzero(array <= low if strict else array < low)
    if bad.size:
        sign = ">" if strict else ">="
        raise InvalidArgumentError(
            name, f"all entries {sign} {low:g}", f"{array[bad[0]]:g} at index {bad[0]}"
        )


def require_range(name: str, value: Sequence[float]) -> None:
    """Raise unless `value` is (low, high) with 0 < low <= high."""
    low, high = as_array(name, value, (2,))
    if not 0 < low <= high:
        raise InvalidArgumentError(name, "(low, high) with 0 < low <= high", tuple(value))


def require_number(
    name: str, value: float, low: float, high: float = np.inf, *, open_low: bool = False
) -> None:
    """Raise unless low <= value <= high (low < value, if open_low) and value is finite."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        raise InvalidArgumentError(name, "a number", repr(value))
    inside = np.isfinite(value) and (low < value if open_low else low <= value) and value <= high
    if not inside:
        left = "(" if open_low else "["
        raise InvalidArgumentError(name, f"a number in {left}{low:g}, {high:g}]", value)


def require_timestep(name: str, value: float) -> None:
    """Raise unless value is a step of at least SHORTEST_STEP [s]."""
    require_number(name, value, SHORTEST_STEP)


def require_duration(
    name: str, value: float, timestep: float = 1e-3, *, open_low: bool = True
) -> None:
    """Raise unless value [s] is above 0 (or 0, if not open_low), and at most MOST_STEPS steps."""
    require_number(name, value, 0.0, open_low=open_low)
    if value > MOST_STEPS * timestep:
        raise InvalidArgumentError(
            name, f"at most {MOST_STEPS} steps of {timestep:g} s", f"{value:g} s"
        )


def require_seed(name: str, value: int) -> None:
    """Raise unless value is an integer from 0 to LARGEST_SEED."""
    require_count(name, value, 0, LARGEST_SEED)


def require_count(name: str, value: int, low: int, high: int | None = None) -> None:
    """Raise unless value is an integer in [low, high]; high is MOST_COUNT if not given."""
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    most = MOST_COUNT if high is None else high
    if not whole or not low <= value <= most:
        open_end = high in (None, LARGEST_SEED, MOST_STEPS) and not (whole and value > most)
        wanted = f"an integer >= {low}" if open_end else f"an integer in [{low}, {most}]"
        raise InvalidArgumentError(name, wanted, repr(value))


def require_name(kind: str, known: Collection[str], *given: str) -> None:
    """Check that names are known ones.

    Raises:
        UnknownNameError: one of them is not.
    """
    for name in given:
        if name not in known:
            raise UnknownNameError(kind, name, known)


def require_names(kind: str, given: Sequence[str], known: Collection[str]) -> None:
    """Check that names are known ones, at least one, each once.

    Raises:
        InvalidArgumentError, UnknownNameError: they are not.
    """
    require_name(kind, known, *given)
    if not given or len(set(given)) < len(given):
        raise InvalidArgumentError(f"{kind}s", "at least one, each once", given)
