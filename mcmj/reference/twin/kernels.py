"""Compiled fixed-step integration of planar spring networks, one body after another.

Every body has its own topology, parameters and readout; arrays carry a leading body axis
and are padded to the largest body, but loops run over a body's own counts, so its bits
depend neither on the batch it is in nor on the number of threads. Each step evaluates

    x1 = l - l0,  x2 = dl/dt,  pull = k1 x1 + k3 x1^3 + d1 x2 + d3 x2^3
    y_c = bias_c + sum_j w_out[c, j] l_j
    F_x,i = pulls + f_i + sum_c w_in[c, i] u_c + w_fb[c, i] (gate_c y_c + offset_c)

Springs are taken four at a time; a body with L springs computes blocks = ceil(L / 4) of
them, the last filled up with springs of no stiffness. A node's row is (p_x, p_y, v_x, v_y).
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from mcmj.reference.twin.leapfrog import advance_leapfrog
from mcmj.reference.twin.rows import copy, load_history, load_rows, store_history, store_rows
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
from mcmj.reference.twin.vectors import (
    interleave_high,
    interleave_low,
    join,
    lane,
    load2,
    load4,
    splat2,
    splat4,
    store,
    unpack_high,
    unpack_low,
)


class Bodies(NamedTuple):
    """B bodies in kernel layout. M, K: largest spring and node count, rounded up to
    multiples of 8."""

    nodes: np.ndarray  # (B,) int64: masses of each body
    springs: np.ndarray  # (B,) int64
    ends: np.ndarray  # (B, 2 M) int32: per block of 4 springs 4 tails, 4 heads; 4 x node
    turns: np.ndarray  # (B, 3 M) int32: order of summation; 2 x (place in pulls, tail, head)
    laws: np.ndarray  # (B, 5 M): per block 4 l0 (m), 4 k1, 4 k3, 4 d1, 4 d3 (SI)
    mobility: np.ndarray  # (B, K): 1 / mass, 0 for fixed nodes (1/kg)
    channels: np.ndarray  # (B, (n_in + n_out) K): w_in then w_fb, transposed
    w_out: np.ndarray  # (B, n_out M)
    bias: np.ndarray  # (B, n_out)


@njit(**COMPILE)
def find_pulls(ends, rows, laws, lengths, pulls, blocks, toolbox, per_step):
    """Replace each spring's length; pulls = force on its tail, springs 0 2 1 3 in a block."""
    for block in range(blocks):
        e, law = 8 * block, 20 * block
        x, y, u, v = transpose(
            load4(rows, ends[e + 4]) - load4(rows, ends[e]),
            load4(rows, ends[e + 5]) - load4(rows, ends[e + 1]),
            load4(rows, ends[e + 6]) - load4(rows, ends[e + 2]),
            load4(rows, ends[e + 7]) - load4(rows, ends[e + 3]),
        )
        length, f_x, f_y = spring_force(
            x,
            y,
            u,
            v,
            load4(lengths, 4 * block),
            load4(laws, law),
            load4(laws, law + 4),
            load4(laws, law + 8),
            load4(laws, law + 12),
            load4(laws, law + 16),
            toolbox,
            splat4(per_step),
        )
        store(lengths, 4 * block, length)
        store(pulls, e, unpack_low(f_x, f_y))
        store(pulls, e + 4, unpack_high(f_x, f_y))


@njit(**COMPILE)
def sum_forces(turns, pulls, force, springs):
    """Add each spring's force to its ends.

    Springs are visited so that neighbours in the list share no node: each addition would
    otherwise wait for the one before it.
    """
    for turn in range(springs):
        tail, head = turns[3 * turn + 1], turns[3 * turn + 2]
        pull = load2(pulls, turns[3 * turn])
        on_tail, on_head = load2(force, tail) + pull, load2(force, head) - pull
        store(force, tail, on_tail)
        store(force, head, on_head)


@njit(**COMPILE)
def find_push(channels, values, room, forces, k, push, nodes):
    """Force (f_x, 0) on each node at step k from the schedule, inputs and feedback."""
    zero = splat4(0.0)
    for i in range(0, nodes, 4):
        total = zero
        for c in range(values.size):
            total += splat4(values[c]) * load4(channels, c * room + i)
        store(push, 2 * i, interleave_low(total, zero))
        store(push, 2 * i + 4, interleave_high(total, zero))
    row = min(k, forces.shape[0] - 1)
    for i in range(forces.shape[1]):
        push[2 * i] += forces[row, i]


@njit(**COMPILE)
def advance_held(rows, force, push, mobility, step, shift, nodes):
    """One step with held force: v += h a; p += h v + shift h^2 a (v before the step).

    shift 1: semi-implicit Euler; 0: explicit Euler; 1/2: exact for a held force. Clears the
    force. Returns the sum of the new state: finite only while all of it is.
    """
    total, zero = splat2(0.0), splat2(0.0)
    for i in range(nodes):
        change = splat2(step * mobility[i]) * (load2(force, 2 * i) + load2(push, 2 * i))
        p, v = load2(rows, 4 * i), load2(rows, 4 * i + 2)
        p, v = held_step(p, v, change, splat2(step), splat2(shift))
        store(force, 2 * i, zero)
        store(rows, 4 * i, join(p, v))  # one store: the row is fetched whole, and soon
        total += p + v
    return lane(total, 0) + lane(total, 1)


@njit(**COMPILE)
def advance_rk4(stage, rows, start, slope, force, push, mobility, step, nodes):
    """Stage 0..3 of classical Runge-Kutta: rows become the next stage's state, or the new one.

    Clears the force and returns the sum of rows, as advance_held does.
    """
    weight, reach, finish = rk4_weights(stage, step)
    total, zero = splat4(0.0), splat2(0.0)
    for i in range(nodes):
        a = splat2(mobility[i]) * (load2(force, 2 * i) + load2(push, 2 * i))
        rate = join(load2(rows, 4 * i + 2), a)
        sums = load4(slope, 4 * i) + splat4(weight) * rate
        row = load4(start, 4 * i) + splat4(reach) * rate + splat4(finish) * sums
        store(force, 2 * i, zero)
        store(slope, 4 * i, sums)
        store(rows, 4 * i, row)
        total += row
    return (lane(total, 0) + lane(total, 1)) + (lane(total, 2) + lane(total, 3))


@njit(**COMPILE)
def shared(values, b):
    """Body b's part of an array whose first axis may be shared (size 1)."""
    return values[min(b, values.shape[0] - 1)]


@njit(**COMPILE)
def integrate_body(b, bodies, schedule, state, record, method, step, steps):
    """Advance body b in place; returns the steps whose new state is finite (all: no trouble)."""
    nodes, springs = bodies.nodes[b], bodies.springs[b]
    blocks, pairs, room = (springs + 3) // 4, (springs + 7) // 8, bodies.mobility.shape[1]
    ends, turns, laws, w_out = bodies.ends[b], bodies.turns[b], bodies.laws[b], bodies.w_out[b]
    mobility, channels, bias = bodies.mobility[b], bodies.channels[b], bodies.bias[b]
    lengths, last = state.lengths[b], state.outputs[b]
    inputs, offset = shared(schedule.inputs, b), shared(schedule.offset, b)
    forces, gate = shared(schedule.forces, b), shared(schedule.gate, b)
    keep_lengths, keep_outputs = record.lengths.shape[1] > 0, record.outputs.shape[1] > 0
    rows, start, slope = np.zeros(4 * room), np.zeros(4 * room), np.zeros(4 * room)
    force, push, pulls = np.zeros(2 * room), np.zeros(2 * room), np.zeros(8 * blocks)
    half, before, older = np.zeros(2 * room), np.zeros(2 * room), np.zeros(2 * room)
    n_outputs, values = last.size, np.zeros(channels.size // room)
    feedback = values.size - n_outputs  # first channel of feedback
    stages, shift, toolbox = method_constants(method)
    per_step = 1.0 / step
    share, total = 1.0, 0.0

    load_rows(rows, state.positions[b], state.velocities[b], mobility, 1, 0)
    if method == LEAPFROG:
        share = load_history(state.history[b], rows, half, before, 1, 0)
    done = 0
    while done < steps:
        for stage in range(stages):
            find_pulls(ends, rows, laws, lengths, pulls, blocks, toolbox, per_step)
            if stage == 0:  # inputs, outputs and offsets hold for the whole step
                if keep_lengths:
                    for j in range(springs):
                        record.lengths[b, done, j] = lengths[j]
                for c in range(inputs.shape[1]):
                    values[c] = inputs[min(done, inputs.shape[0] - 1), c]
                for c in range(n_outputs):
                    sums = weighted_sum(w_out, c * lengths.size, lengths, pairs)
                    output = (lane(sums, 0) + lane(sums, 1)) + (lane(sums, 2) + lane(sums, 3))
                    output += bias[c]
                    fed_back = last[c] if toolbox else output
                    last[c] = output
                    values[feedback + c] = gate[c] * fed_back
                    if offset.shape[1] > 0:
                        values[feedback + c] += offset[min(done, offset.shape[0] - 1), c]
                    if keep_outputs:
                        record.outputs[b, done, c] = output
                find_push(channels, values, room, forces, done, push, nodes)
            sum_forces(turns, pulls, force, springs)
            if method == RK4:
                if stage == 0:
                    begin_rk4(rows, start, slope)
                total = advance_rk4(stage, rows, start, slope, force, push, mobility, step, nodes)
            elif method == LEAPFROG:
                if done == steps - 1:
                    copy(before, older)
                share = 1.0 if done > 0 else share
                total = advance_leapfrog(
                    rows, half, force, push, before, mobility, step, share, nodes
                )
            else:
                total = advance_held(rows, force, push, mobility, step, shift, nodes)
        if not math.isfinite(total):
            break
        done += 1
    store_rows(rows, state.positions[b], state.velocities[b], 1, 0)
    if method == LEAPFROG and steps > 0:
        pushes = before, older
        store_history(state, b, rows, half, pushes, mobility, step, share, 1, 0)
    return done


@njit(**COMPILE)
def integrate_bodies(bodies, schedule, state, record, done, first, last, method, step, steps):
    """Advance bodies first .. last - 1 in place; done (B,) int64 takes their finite steps."""
    for b in range(first, last):
        done[b] = integrate_body(b, bodies, schedule, state, record, method, step, steps)
