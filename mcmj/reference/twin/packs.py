"""Fixed-step integration of many bodies of one topology, four side by side in each register.

The equations, methods and arithmetic are those of `stepping` and `kernels`; here the four
elements of a vector are four bodies instead of four springs, so nothing has to be gathered.
Bodies may differ in every parameter and in their readout. Elements never mix: a body's bits
depend neither on its pack nor on the number of threads.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from mcmj.reference.twin.leapfrog import advance_leapfrog_pack, prepare_leapfrog
from mcmj.reference.twin.rows import load_pack, store_pack
from mcmj.reference.twin.stepping import (
    COMPILE,
    INLINE,
    LEAPFROG,
    RK4,
    at_step,
    begin_rk4,
    held_step,
    load_law,
    new_work,
    rk4_weights,
    spring_force,
    transpose,
    weighted_sum,
)
from mcmj.reference.twin.vectors import load4, splat4, store


class Packs(NamedTuple):
    """P packs of 4 bodies; in flat arrays the body in the pack is the innermost axis."""

    ends: np.ndarray  # (L, 2) int64: node of each spring's tail, head
    laws: np.ndarray  # (P, L 5 4): per spring l0 (m), k1, k3, d1, d3 (SI)
    mobility: np.ndarray  # (P, N 4): 1 / mass, 0 for fixed nodes (1/kg)
    channels: np.ndarray  # (P, (n_in + n_out) N 4): w_in, then w_fb
    w_out: np.ndarray  # (P, n_out E 4), E = L made even
    bias: np.ndarray  # (P, n_out 4)


@njit(**COMPILE)
def pack_of(packs, index):
    """One pack: the same fields without the leading axis."""
    return Packs(
        packs.ends,
        packs.laws[index],
        packs.mobility[index],
        packs.channels[index],
        packs.w_out[index],
        packs.bias[index],
    )


@njit(**INLINE)
def pull_nodes(pack, work, scheme):
    """Replace each spring's length, and add its force to its ends."""
    ends, rows, lengths, force = pack.ends, work.rows, work.lengths, work.force
    for j in range(len(ends)):
        tail, head = 16 * ends[j, 0], 16 * ends[j, 1]
        gap = (
            load4(rows, head) - load4(rows, tail),
            load4(rows, head + 4) - load4(rows, tail + 4),
            load4(rows, head + 8) - load4(rows, tail + 8),
            load4(rows, head + 12) - load4(rows, tail + 12),
        )
        law, before = load_law(pack.laws, 20 * j), load4(lengths, 4 * j)
        length, f_x, f_y, _ = spring_force(gap, law, before, scheme)
        store(lengths, 4 * j, length)
        tail, head = 8 * ends[j, 0], 8 * ends[j, 1]
        store(force, tail, load4(force, tail) + f_x)
        store(force, tail + 4, load4(force, tail + 4) + f_y)
        store(force, head, load4(force, head) - f_x)
        store(force, head + 4, load4(force, head + 4) - f_y)


@njit(**INLINE)
def keep_lengths(lengths, springs, kept, at, stride, present):
    """kept[at + stride * body + j] = length of spring j, for the `present` first bodies."""
    whole = springs // 4 * 4 if present == 4 else 0
    for j in range(0, whole, 4):
        a, b, c, d = transpose(
            load4(lengths, 4 * j),
            load4(lengths, 4 * j + 4),
            load4(lengths, 4 * j + 8),
            load4(lengths, 4 * j + 12),
        )
        store(kept, at + j, a)
        store(kept, at + stride + j, b)
        store(kept, at + 2 * stride + j, c)
        store(kept, at + 3 * stride + j, d)
    for j in range(whole, springs):
        for body in range(present):
            kept[at + stride * body + j] = lengths[4 * j + body]


@njit(**INLINE)
def find_values(pack, work, schedule, state, record, now):
    """Outputs of step k, recorded, and the value of every channel of each body in the pack."""
    first, k, toolbox = now
    inputs, offset, gate = schedule.inputs, schedule.offset, schedule.gate
    lengths, values, outputs = work.lengths, work.values, pack.bias.size // 4
    pairs, feedback = lengths.size // 8, values.size // 4 - outputs
    for c in range(outputs):
        sums = weighted_sum(pack.w_out, c * lengths.size, lengths, pairs)
        store(values, 4 * (feedback + c), sums + load4(pack.bias, 4 * c))
    for body in range(min(4, len(state.outputs) - first)):
        b = first + body
        for c in range(inputs.shape[2]):
            values[4 * c + body] = at_step(inputs, b, k, c)
        for c in range(outputs):
            at = 4 * (feedback + c) + body
            output = values[at]
            fed_back = state.outputs[b, c] if toolbox else output
            values[at] = gate[min(b, gate.shape[0] - 1), c] * fed_back
            if offset.shape[2] > 0:
                values[at] += at_step(offset, b, k, c)
            state.outputs[b, c] = output
            if record.outputs.shape[1] > 0:
                record.outputs[b, k, c] = output


@njit(**INLINE)
def find_push(pack, work, forces, first, k):
    """Horizontal force on each node at step k from the schedule, inputs and feedback."""
    channels = pack.channels
    push, values, nodes = work.push, work.values, work.rows.size // 16
    for i in range(nodes):
        total = splat4(0.0)
        for c in range(values.size // 4):
            total += load4(values, 4 * c) * load4(channels, 4 * (c * nodes + i))
        store(push, 4 * i, total)
    for i in range(forces.shape[2]):
        for body in range(4):
            push[4 * i + body] += at_step(forces, first + body, k, i)


@njit(**COMPILE)
def advance_held(pack, work, scheme):
    """kernels.advance_held for a pack; returns each body's sum of the new state."""
    rows, force, step, shift = work.rows, work.force, splat4(scheme.step), splat4(scheme.shift)
    sums, zero = splat4(0.0), splat4(0.0)
    for i in range(rows.size // 16):
        at = 16 * i
        kick = step * load4(pack.mobility, 4 * i)
        d_x = kick * (load4(force, 8 * i) + load4(work.push, 4 * i))
        d_y = kick * load4(force, 8 * i + 4)
        x, y, u, v = load4(rows, at), load4(rows, at + 4), load4(rows, at + 8), load4(rows, at + 12)
        x, u = held_step(x, u, d_x, step, shift)
        y, v = held_step(y, v, d_y, step, shift)
        store(force, 8 * i, zero)
        store(force, 8 * i + 4, zero)
        store(rows, at, x)
        store(rows, at + 4, y)
        store(rows, at + 8, u)
        store(rows, at + 12, v)
        sums += (x + y) + (u + v)
    return sums


@njit(**COMPILE)
def advance_rk4(pack, work, step, stage):
    """kernels.advance_rk4 for a pack; returns each body's sum of rows."""
    rows, start, slope, force = work.rows, work.start, work.slope, work.force
    weight, reach, finish = rk4_weights(stage, step)
    all_sums = splat4(0.0)
    for i in range(rows.size // 16):
        store(force, 8 * i, load4(force, 8 * i) + load4(work.push, 4 * i))
        for axis in range(2):
            p, v = 16 * i + 4 * axis, 16 * i + 4 * axis + 8
            p_rate, v_rate = (
                load4(rows, v),
                load4(pack.mobility, 4 * i) * load4(force, 8 * i + 4 * axis),
            )
            p_sums = load4(slope, p) + splat4(weight) * p_rate
            v_sums = load4(slope, v) + splat4(weight) * v_rate
            p_new = load4(start, p) + splat4(reach) * p_rate + splat4(finish) * p_sums
            v_new = load4(start, v) + splat4(reach) * v_rate + splat4(finish) * v_sums
            store(slope, p, p_sums)
            store(slope, v, v_sums)
            store(rows, p, p_new)
            store(rows, v, v_new)
            store(force, 8 * i + 4 * axis, splat4(0.0))
            all_sums += p_new + v_new
    return all_sums


@njit(**INLINE)
def advance(pack, work, scheme, stage):
    """kernels.advance for a pack; returns each body's sum of the new state."""
    if scheme.method == RK4:
        if stage == 0:
            begin_rk4(work)
        return advance_rk4(pack, work, scheme.step, stage)
    if scheme.method == LEAPFROG:
        return advance_leapfrog_pack(pack, work, scheme.step)
    return advance_held(pack, work, scheme)


@njit(**INLINE)
def still_running(run, total, first, k):
    """Note the bodies that blew up at step k, by their sums; returns if others are left."""
    running = False
    for body in range(min(4, run.done.size - first)):
        b = first + body
        if run.done[b] == run.steps and not np.isfinite(total[body]):
            run.done[b] = k
        running |= run.done[b] == run.steps
    return running


@njit(**COMPILE)
def integrate_pack(packs, run, index):
    """Advance the bodies 4 index .. 4 index + 3 in place.

    What is recorded of a diverged body after its last finite step means nothing.
    """
    pack, first, schedule, scheme = pack_of(packs, index), 4 * index, run.schedule, run.scheme
    present, springs, nodes = min(4, run.done.size - first), len(pack.ends), pack.mobility.size // 4
    lengths = np.zeros(8 * ((springs + 1) // 2))
    work = new_work(nodes, pack.channels.size // pack.mobility.size, lengths, 4)
    kept, (_, rows_kept, row_size) = run.record.lengths.reshape(-1), run.record.lengths.shape
    total = np.zeros(4)
    state, record, forces = run.state, run.record, schedule.forces
    load_pack(run, work, pack.mobility, first)
    for body in range(present):
        run.done[first + body] = run.steps
    for k in range(run.steps):
        if scheme.method == LEAPFROG:
            prepare_leapfrog(work, k, run.steps)
        for stage in range(scheme.stages):
            pull_nodes(pack, work, scheme)
            if stage == 0:  # inputs, outputs and offsets hold for the whole step
                if rows_kept > 0:
                    at = (first * rows_kept + k) * row_size
                    keep_lengths(lengths, springs, kept, at, rows_kept * row_size, present)
                now = first, k, scheme.toolbox
                find_values(pack, work, schedule, state, record, now)
                find_push(pack, work, forces, first, k)
            store(total, 0, advance(pack, work, scheme, stage))
        if not still_running(run, total, first, k):
            break
    store_pack(run, work, pack.mobility, first)


@njit(**COMPILE)
def integrate_packs(packs, run, first, last):
    """Advance packs first .. last - 1 in place."""
    for index in range(first, last):
        integrate_pack(packs, run, index)
