"""What the compiled kernels of single bodies and of packs share: schedules, state, arithmetic.

Vectors hold four springs of one body (`kernels`) or one spring of four bodies (`packs`); the
arithmetic is the same. The spring law, with x1 = l - l0 and x2 = dl/dt, is

    pull = k1 x1 + k3 x1^3 + d1 x2 + d3 x2^3
"""

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from mcmj.core.integrators import TWINS
from mcmj.reference.twin.vectors import (
    halves_high,
    halves_low,
    load4,
    splat4,
    square_root,
    unpack_high,
    unpack_low,
)

# methods by number; the authors' toolbox has two that MuJoCo has not
METHODS = {name: i for i, name in enumerate((*TWINS, "toolbox_euler", "toolbox_rk"))}
SEMI_IMPLICIT_EULER, RK4, LEAPFROG = (
    METHODS[name] for name in ("semi_implicit_euler", "rk4", "leapfrog")
)
TOOLBOX_EULER, TOOLBOX_RK = METHODS["toolbox_euler"], METHODS["toolbox_rk"]

COMPILE: dict[str, Any] = {
    "fastmath": {"contract"},  # not nnan, ninf: a diverging body must be seen to diverge
    "error_model": "numpy",
    "boundscheck": False,
    "nogil": True,
    "cache": True,
}


class Schedule(NamedTuple):
    """What happens when; a first or second axis of size 1 is shared by bodies or steps."""

    inputs: np.ndarray  # (B or 1, T or 1, n_in or 0)
    offset: np.ndarray  # (B or 1, T or 1, n_out or 0): added to the fed-back outputs
    forces: np.ndarray  # (B or 1, T or 1, N or 0): horizontal, N
    gate: np.ndarray  # (B or 1, n_out): 1 closes the loop, 0 opens it


class KernelState(NamedTuple):
    """What a run carries over to the next; updated in place."""

    positions: np.ndarray  # (B, N, 2) m
    velocities: np.ndarray  # (B, N, 2) m/s
    lengths: np.ndarray  # (B, M) m: lengths one step ago (toolbox methods only)
    outputs: np.ndarray  # (B, n_out): outputs one step ago (toolbox methods only)
    history: np.ndarray  # (B, N, 5): see rows.load_history (leapfrog only)


class Record(NamedTuple):
    """Caller-supplied results; a second axis of size 0 means not recorded."""

    lengths: np.ndarray  # (B, T or 0, L): at t_k, before step k
    outputs: np.ndarray  # (B, T or 0, n_out)


@njit(**COMPILE)
def spring_pull(x1, x2, k1, k3, d1, d3):
    """p(x1) + q(x2), N: what a stretched, lengthening spring pulls with."""
    return x1 * (k1 + k3 * x1 * x1) + x2 * (d1 + d3 * x2 * x2)


@njit(**COMPILE)
def spring_force(x, y, u, v, before, l0, k1, k3, d1, d3, toolbox, per_step):
    """Four springs from the gaps between their ends (m, m/s): lengths, forces on the tails.

    The toolbox methods take dl/dt as the change since the last step, others from velocities.
    """
    square = x * x + y * y
    length = square_root(square)
    inverse = length * (splat4(1.0) / square)  # neither root nor quotient waits for the other
    rate = (x * u + y * v) * inverse
    if toolbox:
        rate = (length - before) * per_step
    tension = spring_pull(length - l0, rate, k1, k3, d1, d3) * inverse
    return length, x * tension, y * tension


@njit(**COMPILE)
def transpose(a, b, c, d):
    """Four rows of four -> their four columns."""
    ab, ab_odd = unpack_low(a, b), unpack_high(a, b)
    cd, cd_odd = unpack_low(c, d), unpack_high(c, d)
    return (
        halves_low(ab, cd),
        halves_low(ab_odd, cd_odd),
        halves_high(ab, cd),
        halves_high(ab_odd, cd_odd),
    )


@njit(**COMPILE)
def weighted_sum(weights, at, lengths, pairs):
    """sum over k < 2 pairs of weights[at+4k:at+4k+4] * lengths[4k:4k+4], in a fixed order."""
    even, odd = splat4(0.0), splat4(0.0)
    for k in range(pairs):
        even += load4(weights, at + 8 * k) * load4(lengths, 8 * k)
        odd += load4(weights, at + 8 * k + 4) * load4(lengths, 8 * k + 4)
    return even + odd


@njit(**COMPILE)
def method_constants(method):
    """Stages a step, shift of held_step, and whether springs and feedback look back."""
    shift = 1.0 if method == SEMI_IMPLICIT_EULER else 0.5 if method == TOOLBOX_RK else 0.0
    return (4 if method == RK4 else 1), shift, method >= TOOLBOX_EULER


@njit(**COMPILE)
def held_step(p, v, change, step, shift):
    """Position and velocity after a step with held force, of which `change` = step * a."""
    return p + step * (v + shift * change), v + change


@njit(**COMPILE)
def rk4_weights(stage, step):
    """Stage s goes to start + reach * rate + finish * slope, with slope += weight * rate."""
    weight = 1.0 if stage == 0 or stage == 3 else 2.0
    if stage == 3:
        return weight, 0.0, step / 6.0
    return weight, (step if stage == 2 else 0.5 * step), 0.0


@njit(**COMPILE)
def begin_rk4(rows, start, slope):
    """Remember the state at t_k."""
    for i in range(rows.size):
        start[i] = rows[i]
        slope[i] = 0.0
