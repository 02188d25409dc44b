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
def advance_leapfrog(rows, half, force, push, before, mobility, step, share, nodes):
    """One step; `before` takes the push. Clears the force, returns the sum of the new rows."""
    total, zero = splat2(0.0), splat2(0.0)
    for i in range(nodes):
        held = load2(push, 2 * i)
        mean = splat2(0.5) * (held + load2(before, 2 * i))
        kick = splat2(step * mobility[i]) * (splat2(share) * load2(force, 2 * i) + mean)
        w = load2(half, 2 * i) + kick
        p, v = load2(rows, 4 * i) + splat2(step) * w, w + splat2(0.5) * kick
        store(force, 2 * i, zero)
        store(before, 2 * i, held)
        store(half, 2 * i, w)
        store(rows, 4 * i, join(p, v))
        total += p + v
    return lane(total, 0) + lane(total, 1)


@njit(**COMPILE)
def advance_leapfrog_pack(rows, half, force, push, before, mobility, step, share, nodes, total):
    """advance_leapfrog for a pack; share and total (4,): each body's."""
    sums, zero, reach = splat4(0.0), splat4(0.0), splat4(step)
    shares = load4(share, 0)
    for i in range(nodes):
        scale = reach * load4(mobility, 4 * i)
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
    store(total, 0, sums)
