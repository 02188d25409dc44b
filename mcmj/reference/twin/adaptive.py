"""The leapfrog in steps as short as the dampers ask for.

Dampers brake at a rate of r q'(x2) = r (d1 + 3 d3 x2^2) at most, r as in `damper_reach`. The
leapfrog bears steps h up to h rate = 1; one that begins with more than 1/2 is taken in parts:

    start      w = v = V_k, the velocity that the dampers see
    part       h_i = rest / ceil(2 rest * rate),  rate anew in each
               w' = w + (h_{i-1} + h_i) / 2 a_i,  a_i = M^-1 [F(p, V) + f_k],  h_{-1} = 0
               p' = p + h_i w',  V' = w' + h_i / 2 a_i
    end        v = w + h_i / 2 a,  a = M^-1 [F(p, V) + f_k]

It remembers no more than the leapfrog: V = v and w = v - h/2 a, as after a step of length h.
All other steps are the leapfrog's. A blow needs few parts, however fast or stiff: a cubic damper
alone, x2' = -d3 x2^3 / m, has x2^2 < m / (2 d3 t), so that its rate is at most 3 / (2 t).
"""

import math

import numpy as np
from numba import njit

from mcmj.reference.twin.forces import find_pulls, sum_forces
from mcmj.reference.twin.stepping import COMPILE, INLINE
from mcmj.reference.twin.vectors import join, lane, load2, splat2, store

TOO_FAST = 0.5  # h rate from which a step is taken in parts
MOST_PARTS = 100_000  # of a step; more is a blow-up


@njit(**COMPILE)
def begin_parts(work):
    """w = V."""
    for i in range(work.half.size // 2):
        store(work.half, 2 * i, load2(work.rows, 4 * i + 2))


@njit(**COMPILE)
def advance_part(body, work, before, part):
    """One part after one of length `before` (s); clears the force."""
    rows, half, force = work.rows, work.half, work.force
    for i in range(rows.size // 4):
        a = splat2(body.mobility[i]) * (load2(force, 2 * i) + load2(work.push, 2 * i))
        w = load2(half, 2 * i) + splat2(0.5 * (before + part)) * a
        p, v = load2(rows, 4 * i) + splat2(part) * w, w + splat2(0.5 * part) * a
        store(force, 2 * i, splat2(0.0))
        store(half, 2 * i, w)
        store(rows, 4 * i, join(p, v))


@njit(**COMPILE)
def end_parts(body, work, last, step):
    """V = v and w of a step's end; clears the force, returns the sum of the new rows."""
    rows, half, force, push = work.rows, work.half, work.force, work.push
    total = splat2(0.0)
    for i in range(rows.size // 4):
        held = load2(push, 2 * i)
        a = splat2(0.5 * body.mobility[i]) * (load2(force, 2 * i) + held)
        p, v = load2(rows, 4 * i), load2(half, 2 * i) + splat2(last) * a
        store(force, 2 * i, splat2(0.0))
        store(half, 2 * i, v - splat2(step) * a)
        store(rows, 4 * i, join(p, v))
        store(work.before, 2 * i, held)
        store(work.older, 2 * i, held)
        total += p + v
    work.share[0] = 1.0
    return lane(total, 0) + lane(total, 1)


@njit(**INLINE)
def take_substeps(body, work, pulls, scheme, rate):
    """One step in parts, from the force and rate (1/s) at its start; as advance_leapfrog."""
    rest, part, parts = scheme.step, 0.0, 0
    begin_parts(work)
    while rest > 0.0 and parts < MOST_PARTS:
        before, left = part, max(1.0, np.ceil(rest * rate / TOO_FAST))
        part = rest / left
        rest = rest - part if left > 1.0 else 0.0
        advance_part(body, work, before, part)
        rate = find_pulls(body, work, pulls, scheme)
        sum_forces(body, pulls, work)
        parts += 1
    total = end_parts(body, work, part, scheme.step)
    return total if rest == 0.0 else math.nan
