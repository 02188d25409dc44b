"""Fixed-step integration of many bodies of one topology, four side by side in each register.

The equations, methods and arithmetic are those of `stepping` and `kernels`; here the four
elements of a vector are four bodies instead of four springs, so nothing has to be gathered.
Bodies may differ in every parameter and in their readout. Elements never mix: a body's bits
depend neither on its pack nor on the number of threads.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from mcmj.reference.twin.leapfrog import advance_leapfrog_pack
from mcmj.reference.twin.rows import copy, load_pack, store_pack, store_pack_history
from mcmj.reference.twin.stepping import (
    COMPILE,
    LEAPFROG,
    RK4,
    begin_rk4,
    held_step,
    method_constants,
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
def pull_nodes(ends, rows, laws, lengths, force, toolbox, per_step):
    """Replace each spring's length, and add its force to its ends."""
    for j in range(len(ends)):
        tail, head = 16 * ends[j, 0], 16 * ends[j, 1]
        length, f_x, f_y = spring_force(
            load4(rows, head) - load4(rows, tail),
            load4(rows, head + 4) - load4(rows, tail + 4),
            load4(rows, head + 8) - load4(rows, tail + 8),
            load4(rows, head + 12) - load4(rows, tail + 12),
            load4(lengths, 4 * j),
            load4(laws, 20 * j),
            load4(laws, 20 * j + 4),
            load4(laws, 20 * j + 8),
            load4(laws, 20 * j + 12),
            load4(laws, 20 * j + 16),
            toolbox,
            splat4(per_step),
        )
        store(lengths, 4 * j, length)
        tail, head = 8 * ends[j, 0], 8 * ends[j, 1]
        store(force, tail, load4(force, tail) + f_x)
        store(force, tail + 4, load4(force, tail + 4) + f_y)
        store(force, head, load4(force, head) - f_x)
        store(force, head + 4, load4(force, head + 4) - f_y)


@njit(**COMPILE)
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


@njit(**COMPILE)
def find_push(channels, values, nodes, forces, k, first, push):
    """Horizontal force on each node at step k from the schedule, inputs and feedback."""
    for i in range(nodes):
        total = splat4(0.0)
        for c in range(values.size // 4):
            total += load4(values, 4 * c) * load4(channels, 4 * (c * nodes + i))
        store(push, 4 * i, total)
    row = min(k, forces.shape[1] - 1)
    for i in range(forces.shape[2]):
        for body in range(4):
            push[4 * i + body] += forces[min(first + body, forces.shape[0] - 1), row, i]


@njit(**COMPILE)
def advance_held(rows, force, push, mobility, step, shift, nodes, total):
    """kernels.advance_held for a pack; total (4,) takes each body's sum of the new state."""
    sums, zero = splat4(0.0), splat4(0.0)
    for i in range(nodes):
        at = 16 * i
        kick = splat4(step) * load4(mobility, 4 * i)
        d_x = kick * (load4(force, 8 * i) + load4(push, 4 * i))
        d_y = kick * load4(force, 8 * i + 4)
        x, y, u, v = load4(rows, at), load4(rows, at + 4), load4(rows, at + 8), load4(rows, at + 12)
        x, u = held_step(x, u, d_x, splat4(step), splat4(shift))
        y, v = held_step(y, v, d_y, splat4(step), splat4(shift))
        store(force, 8 * i, zero)
        store(force, 8 * i + 4, zero)
        store(rows, at, x)
        store(rows, at + 4, y)
        store(rows, at + 8, u)
        store(rows, at + 12, v)
        sums += (x + y) + (u + v)
    store(total, 0, sums)


@njit(**COMPILE)
def advance_rk4(stage, rows, start, slope, force, push, mobility, step, nodes, total):
    """kernels.advance_rk4 for a pack; total (4,) takes each body's sum of rows."""
    weight, reach, finish = rk4_weights(stage, step)
    all_sums = splat4(0.0)
    for i in range(nodes):
        store(force, 8 * i, load4(force, 8 * i) + load4(push, 4 * i))
        for axis in range(2):
            p, v = 16 * i + 4 * axis, 16 * i + 4 * axis + 8
            p_rate, v_rate = load4(rows, v), load4(mobility, 4 * i) * load4(force, 8 * i + 4 * axis)
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
    store(total, 0, all_sums)


@njit(**COMPILE)
def find_values(schedule, state, record, w_out, bias, lengths, now, values, sums):
    """Outputs of step k, recorded, and the value of every channel of each body in the pack."""
    first, k, toolbox = now
    n_outputs, pairs = bias.size // 4, lengths.size // 8
    feedback = values.size // 4 - n_outputs
    inputs, offset, gate = schedule.inputs, schedule.offset, schedule.gate
    for c in range(n_outputs):
        store(sums, 4 * c, weighted_sum(w_out, c * lengths.size, lengths, pairs))
    for body in range(4):
        b = min(first + body, len(state.outputs) - 1)
        for c in range(inputs.shape[2]):
            row = min(k, inputs.shape[1] - 1)
            values[4 * c + body] = inputs[min(b, inputs.shape[0] - 1), row, c]
        for c in range(n_outputs):
            output = sums[4 * c + body] + bias[4 * c + body]
            fed_back = state.outputs[b, c] if toolbox else output
            value = gate[min(b, gate.shape[0] - 1), c] * fed_back
            if offset.shape[2] > 0:
                row = min(k, offset.shape[1] - 1)
                value += offset[min(b, offset.shape[0] - 1), row, c]
            values[4 * (feedback + c) + body] = value
            if first + body == b:
                state.outputs[b, c] = output
                if record.outputs.shape[1] > 0:
                    record.outputs[b, k, c] = output


@njit(**COMPILE)
def integrate_pack(pack, packs, schedule, state, record, done, method, step, steps):
    """Advance the bodies 4 pack .. 4 pack + 3 in place; done takes their finite steps.

    What is recorded of a diverged body after its last finite step means nothing.
    """
    first = 4 * pack
    present = min(4, len(done) - first)
    ends, laws, mobility = packs.ends, packs.laws[pack], packs.mobility[pack]
    channels, w_out, bias = packs.channels[pack], packs.w_out[pack], packs.bias[pack]
    springs, nodes = len(ends), mobility.size // 4
    rows, start, slope = np.zeros(16 * nodes), np.zeros(16 * nodes), np.zeros(16 * nodes)
    force, push = np.zeros(8 * nodes), np.zeros(4 * nodes)
    lengths, values = np.zeros(8 * ((springs + 1) // 2)), np.zeros(channels.size // nodes)
    half, before, older = np.zeros(8 * nodes), np.zeros(4 * nodes), np.zeros(4 * nodes)
    sums, total, share = np.zeros(bias.size), np.zeros(4), np.ones(4)
    kept, (_, rows_kept, row_size) = record.lengths.reshape(-1), record.lengths.shape
    stages, shift, toolbox = method_constants(method)
    per_step = 1.0 / step

    leapfrog = method == LEAPFROG
    load_pack(state, first, mobility, rows, lengths, springs, half, before, share, leapfrog)
    for body in range(present):
        done[first + body] = steps
    for k in range(steps):
        for stage in range(stages):
            pull_nodes(ends, rows, laws, lengths, force, toolbox, per_step)
            if stage == 0:  # inputs, outputs and offsets hold for the whole step
                if rows_kept > 0:
                    at = (first * rows_kept + k) * row_size
                    keep_lengths(lengths, springs, kept, at, rows_kept * row_size, present)
                now = first, k, toolbox
                find_values(schedule, state, record, w_out, bias, lengths, now, values, sums)
                find_push(channels, values, nodes, schedule.forces, k, first, push)
            if method == RK4:
                if stage == 0:
                    begin_rk4(rows, start, slope)
                advance_rk4(stage, rows, start, slope, force, push, mobility, step, nodes, total)
            elif leapfrog:
                if k == steps - 1:
                    copy(before, older)
                if k == 1:
                    share[0] = share[1] = share[2] = share[3] = 1.0
                advance_leapfrog_pack(
                    rows, half, force, push, before, mobility, step, share, nodes, total
                )
            else:
                advance_held(rows, force, push, mobility, step, shift, nodes, total)
        running = False
        for body in range(present):
            if done[first + body] == steps and not np.isfinite(total[body]):
                done[first + body] = k
            running |= done[first + body] == steps
        if not running:
            break
    store_pack(state, first, present, rows, lengths, springs)
    if leapfrog and steps > 0:
        pushes = before, older
        store_pack_history(state, first, present, rows, half, pushes, mobility, step, share)


@njit(**COMPILE)
def integrate_packs(packs, schedule, state, record, done, first, last, method, step, steps):
    """Advance packs first .. last - 1 in place; done (B,) int64 takes the finite steps."""
    for pack in range(first, last):
        integrate_pack(pack, packs, schedule, state, record, done, method, step, steps)
