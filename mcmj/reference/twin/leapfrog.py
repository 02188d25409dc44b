"""The leapfrog: second order at one force evaluation a step.

`mcmj.core.callbacks.leapfrog` has the account:

    w' = w + h M^-1 [s F(p, V) + (f_k + f_{k-1}) / 2],   s = 1
    p' = p + h w',   V' = w' + (w' - w) / 2
    start:  w = V = v_0,  f_{-1} = 0,  s = 1/2
    v' = w' + h/2 M^-1 [F(p, V) + f_k]        only at the end of a run

F are the forces of the springs, whose dampers see the row's velocity V; w is the velocity half
a step back, f the horizontal force held over a step.
"""

from numba import njit

from mcmj.reference.twin.stepping import COMPILE
from mcmj.reference.twin.vectors import join, lane, load2, load4, splat2, splat4, store


@njit(**COMPILE)
def prepare_leapfrog(work, k, steps):
    """s and f_{k-1} before step k of a run."""
    if k == 1:
        for lane in range(work.share.size):
            work.share[lane] = 1.0
    if k == steps - 1:
        for i in range(work.before.size):  # faster to compile than a slice
            work.older[i] = work.before[i]


@njit(**COMPILE)
def advance_leapfrog(body, work, step):
    """One step; work.before takes the push. Clears the force, returns the sum of the new rows."""
    rows, half, force, push, before = work.rows, work.half, work.force, work.push, work.before
    total, zero, share = splat2(0.0), splat2(0.0), splat2(work.share[0])
    for i in range(rows.size // 4):
        held = load2(push, 2 * i)
        mean = splat2(0.5) * (held + load2(before, 2 * i))
        kick = splat2(step * body.mobility[i]) * (share * load2(force, 2 * i) + mean)
        w = load2(half, 2 * i) + kick
        p, v = load2(rows, 4 * i) + splat2(step) * w, w + splat2(0.5) * kick
        store(force, 2 * i, zero)
        store(before, 2 * i, held)
        store(half, 2 * i, w)
        store(rows, 4 * i, join(p, v))
        total += p + v
    return lane(total, 0) + lane(total, 1)


@njit(**COMPILE)
def advance_leapfrog_pack(pack, work, step):
    """advance_leapfrog for a pack; returns each body's sum."""
    rows, half, force, push, before = work.rows, work.half, work.force, work.push, work.before
    sums, zero, reach, shares = splat4(0.0), splat4(0.0), splat4(step), load4(work.share, 0)
    for i in range(rows.size // 16):
        scale = reach * load4(pack.mobility, 4 * i)
        held = load4(push, 4 * i)
        mean = splat4(0.5) * (held + load4(before, 4 * i))
        store(before, 4 * i, held)
        for axis in range(2):
            at, w_at = 16 * i + 4 * axis, 8 * i + 4 * axis
            kick = scale * (shares * load4(force, w_at) + mean)
            w = load4(half, w_at) + kick
            p, v = load4(rows, at) + reach * w, w + splat4(0.5) * kick
            store(force, w_at, zero)
            store(half, w_at, w)
            store(rows, at, p)
            store(rows, at + 8, v)
            sums += p + v
            mean = zero  # nothing pushes vertically
    return sums
