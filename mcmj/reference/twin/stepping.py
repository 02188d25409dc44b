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
SEMI_IMPLICIT_EULER, RK4, LEAPFROG, ADAPTIVE_LEAPFROG = (
    METHODS[name] for name in ("semi_implicit_euler", "rk4", "leapfrog", "adaptive_leapfrog")
)
TOOLBOX_EULER, TOOLBOX_RK = METHODS["toolbox_euler"], METHODS["toolbox_rk"]

COMPILE: dict[str, Any] = {
    "fastmath": {"contract"},  # not nnan, ninf: a diverging body must be seen to diverge
    "error_model": "numpy",
    "boundscheck": False,
    "nogil": True,
    "cache": True,
}
# For what an inner loop calls with many arrays: a call would copy their descriptions. Numba must
# find that arguments need no reference counts, so such a function returns in one place only.
INLINE: dict[str, Any] = {**COMPILE, "forceinline": True}


class KernelDrive(NamedTuple):
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
    history: np.ndarray  # (B, N, 5): see rows.load_history (leapfrogs only)


class Record(NamedTuple):
    """Caller-supplied results; a second axis of size 0 means not recorded."""

    lengths: np.ndarray  # (B, T or 0, L): at t_k, before step k
    outputs: np.ndarray  # (B, T or 0, n_out)


class Scheme(NamedTuple):
    """A method and its step."""

    method: int  # one of METHODS' numbers
    step: float  # s
    per_step: float  # 1 / step
    stages: int  # force evaluations a step
    shift: float  # see held_step
    toolbox: bool  # springs and feedback look one step back
    leapfrog: bool  # remembers a half-step velocity and a push
    adaptive: bool  # asks for the dampers' rate


class KernelRun(NamedTuple):
    """`steps` steps of B bodies."""

    schedule: KernelDrive
    state: KernelState
    record: Record
    done: np.ndarray  # (B,) int64: takes every body's finite steps
    scheme: Scheme
    steps: int


class Work(NamedTuple):
    """Scratch of `width` bodies side by side: 1, or 4 in a pack; see `rows` for the layout."""

    rows: np.ndarray  # (4 N width,) position and velocity of each node, m, m/s
    force: np.ndarray  # (2 N width,) N, by the springs; cleared by each stage
    push: np.ndarray  # horizontal force on each node by schedule, inputs and feedback, N
    lengths: np.ndarray  # of the springs, m
    values: np.ndarray  # (n_channels width,): inputs, then what is fed back
    start: np.ndarray  # Runge-Kutta: rows at t_k
    slope: np.ndarray  # Runge-Kutta: weighted sum of the slopes
    half: np.ndarray  # leapfrog: velocities half a step back, m/s
    before: np.ndarray  # leapfrog: push of the step before
    older: np.ndarray  # leapfrog: and of the one before that, at a run's end
    share: np.ndarray  # (width,) leapfrog: s of the step


def scheme_of(method: str, step: float) -> Scheme:
    """The scheme of a method, one of METHODS, with a step in s."""
    number = METHODS[method]
    shift = {SEMI_IMPLICIT_EULER: 1.0, TOOLBOX_RK: 0.5}.get(number, 0.0)
    return Scheme(
        number,
        step,
        1.0 / step,
        4 if number == RK4 else 1,
        shift,
        number >= TOOLBOX_EULER,
        number in (LEAPFROG, ADAPTIVE_LEAPFROG),
        number == ADAPTIVE_LEAPFROG,
    )


@njit(**COMPILE)
def new_work(nodes, channels, lengths, width):
    """Scratch for bodies of so many nodes and channels."""
    size = nodes * width
    rows, start, slope = np.zeros(4 * size), np.zeros(4 * size), np.zeros(4 * size)
    force, half, values = np.zeros(2 * size), np.zeros(2 * size), np.zeros(channels * width)
    gaps = 2 * size + 6  # find_push fills four nodes at a time
    push, before, older = np.zeros(gaps), np.zeros(gaps), np.zeros(gaps)
    share = np.ones(width)
    return Work(rows, force, push, lengths, values, start, slope, half, before, older, share)


@njit(**COMPILE)
def at_step(values, b, k, c):
    """Element c of body b at step k; an axis of size 1 is shared."""
    return values[min(b, values.shape[0] - 1), min(k, values.shape[1] - 1), c]


@njit(**COMPILE)
def load_law(laws, at):
    """l0, k1, k3, d1, d3 of four springs."""
    return (
        load4(laws, at),
        load4(laws, at + 4),
        load4(laws, at + 8),
        load4(laws, at + 12),
        load4(laws, at + 16),
    )


@njit(**COMPILE)
def spring_force(gap, law, before, scheme):
    """Four springs from the gaps (x, y, u, v) between their ends (m, m/s).

    Returns their lengths, the forces (f_x, f_y) on their tails, and their rates dl/dt: with the
    toolbox methods the change since the length `before`, with others from the velocities.
    """
    x, y, u, v = gap
    l0, k1, k3, d1, d3 = law
    square = x * x + y * y
    length = square_root(square)
    inverse = length * (splat4(1.0) / square)  # neither root nor quotient waits for the other
    x1, x2 = length - l0, (x * u + y * v) * inverse
    if scheme.toolbox:
        x2 = (length - before) * splat4(scheme.per_step)
    pull = x1 * (k1 + k3 * x1 * x1) + x2 * (d1 + d3 * x2 * x2)
    tension = pull * inverse
    return length, x * tension, y * tension, x2


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
def begin_rk4(work):
    """Remember the state at t_k."""
    for i in range(work.rows.size):
        work.start[i] = work.rows[i]
        work.slope[i] = 0.0
