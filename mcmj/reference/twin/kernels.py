"""Compiled fixed-step integration of planar spring networks, one body after another.

Every body has its own topology, parameters and readout; arrays carry a leading body axis
and are padded to the largest body, but loops run over a body's own counts, so its bits
depend neither on the batch it is in nor on the number of threads. Each step evaluates

    x1 = l - l0,  x2 = dl/dt,  pull = k1 x1 + k3 x1^3 + d1 x2 + d3 x2^3
    y_c = bias_c + sum_j w_out[c, j] l_j
    F_x,i = pulls + f_i + sum_c w_in[c, i] u_c + w_fb[c, i] (gate_c y_c + offset_c)

A node's row is (p_x, p_y, v_x, v_y).
"""

import math

import numpy as np
from numba import njit

from mcmj.reference.twin.adaptive import TOO_FAST, take_substeps
from mcmj.reference.twin.forces import body_of, find_pulls, sum_forces
from mcmj.reference.twin.leapfrog import advance_leapfrog, prepare_leapfrog
from mcmj.reference.twin.rows import load_body, store_body
from mcmj.reference.twin.stepping import (
    COMPILE,
    INLINE,
    RK4,
    at_step,
    begin_rk4,
    held_step,
    new_work,
    rk4_weights,
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
)


@njit(**INLINE)
def find_values(body, work, schedule, state, record, now):
    """Outputs of step k, recorded, and the value of every channel."""
    b, k, toolbox = now
    offset, gate = schedule.offset, schedule.gate
    inputs, lengths, values = schedule.inputs, work.lengths, work.values
    feedback, pairs = values.size - body.bias.size, (body.springs + 7) // 8
    for c in range(inputs.shape[2]):
        values[c] = at_step(inputs, b, k, c)
    for c in range(body.bias.size):
        sums = weighted_sum(body.w_out, c * lengths.size, lengths, pairs)
        output = (lane(sums, 0) + lane(sums, 1)) + (lane(sums, 2) + lane(sums, 3)) + body.bias[c]
        fed_back = state.outputs[b, c] if toolbox else output
        value = gate[min(b, gate.shape[0] - 1), c] * fed_back
        if offset.shape[2] > 0:
            value += at_step(offset, b, k, c)
        values[feedback + c] = value
        state.outputs[b, c] = output
        if record.outputs.shape[1] > 0:
            record.outputs[b, k, c] = output


@njit(**INLINE)
def find_push(body, work, forces, b, k):
    """Force (f_x, 0) on each node at step k from the schedule, inputs and feedback."""
    channels, room = body.channels, body.mobility.size
    push, values, zero = work.push, work.values, splat4(0.0)
    for i in range(0, body.nodes, 4):
        total = zero
        for c in range(values.size):
            total += splat4(values[c]) * load4(channels, c * room + i)
        store(push, 2 * i, interleave_low(total, zero))
        store(push, 2 * i + 4, interleave_high(total, zero))
    for i in range(forces.shape[2]):
        push[2 * i] += at_step(forces, b, k, i)


@njit(**COMPILE)
def advance_held(body, work, scheme):
    """One step with held force: v += h a; p += h v + shift h^2 a (v before the step).

    shift 1: semi-implicit Euler; 0: explicit Euler; 1/2: exact for a held force. Clears the
    force. Returns the sum of the new state: finite only while all of it is.
    """
    rows, force, step, shift = work.rows, work.force, splat2(scheme.step), splat2(scheme.shift)
    total, zero = splat2(0.0), splat2(0.0)
    for i in range(rows.size // 4):
        applied = load2(force, 2 * i) + load2(work.push, 2 * i)
        change = splat2(scheme.step * body.mobility[i]) * applied
        p, v = load2(rows, 4 * i), load2(rows, 4 * i + 2)
        p, v = held_step(p, v, change, step, shift)
        store(force, 2 * i, zero)
        store(rows, 4 * i, join(p, v))  # one store: the row is fetched whole, and soon
        total += p + v
    return lane(total, 0) + lane(total, 1)


@njit(**COMPILE)
def advance_rk4(body, work, step, stage):
    """Stage 0..3 of classical Runge-Kutta: rows become the next stage's state, or the new one.

    Clears the force and returns the sum of rows, as advance_held does.
    """
    rows, start, slope, force = work.rows, work.start, work.slope, work.force
    weight, reach, finish = rk4_weights(stage, step)
    total, zero = splat4(0.0), splat2(0.0)
    for i in range(rows.size // 4):
        a = splat2(body.mobility[i]) * (load2(force, 2 * i) + load2(work.push, 2 * i))
        rate = join(load2(rows, 4 * i + 2), a)
        sums = load4(slope, 4 * i) + splat4(weight) * rate
        row = load4(start, 4 * i) + splat4(reach) * rate + splat4(finish) * sums
        store(force, 2 * i, zero)
        store(slope, 4 * i, sums)
        store(rows, 4 * i, row)
        total += row
    return (lane(total, 0) + lane(total, 1)) + (lane(total, 2) + lane(total, 3))


@njit(**INLINE)
def advance(body, work, scheme, stage):
    """One stage of a step; returns the sum of the new state."""
    if scheme.method == RK4:
        if stage == 0:
            begin_rk4(work)
        return advance_rk4(body, work, scheme.step, stage)
    if scheme.leapfrog:
        return advance_leapfrog(body, work, scheme.step)
    return advance_held(body, work, scheme)


@njit(**COMPILE)
def integrate_body(bodies, run, b):
    """Advance body b in place; done[b] = steps whose new state is finite (all: no trouble)."""
    body, schedule, scheme, kept = body_of(bodies, b), run.schedule, run.scheme, run.record.lengths
    channels = body.channels.size // body.mobility.size
    lengths = run.state.lengths[b]
    work = new_work(body.nodes, channels, lengths, 1)
    pulls = np.zeros(8 * ((body.springs + 3) // 4))
    state, record, forces = run.state, run.record, schedule.forces
    load_body(run, work, body.mobility, b, 0)
    k, total = 0, 0.0
    while k < run.steps:
        if scheme.leapfrog:
            prepare_leapfrog(work, k, run.steps)
        for stage in range(scheme.stages):
            rate = find_pulls(body, work, pulls, scheme)
            if stage == 0:  # inputs, outputs and offsets hold for the whole step
                if kept.shape[1] > 0:
                    for j in range(body.springs):
                        kept[b, k, j] = lengths[j]
                now = b, k, scheme.toolbox
                find_values(body, work, schedule, state, record, now)
                find_push(body, work, forces, b, k)
            sum_forces(body, pulls, work)
            if scheme.adaptive and scheme.step * rate > TOO_FAST:
                total = take_substeps(body, work, pulls, scheme, rate)
            else:
                total = advance(body, work, scheme, stage)
        if not math.isfinite(total):
            break
        k += 1
    store_body(run, work, body.mobility, b, 0)
    run.done[b] = k


@njit(**COMPILE)
def integrate_bodies(bodies, run, first, last):
    """Advance bodies first .. last - 1 in place."""
    for b in range(first, last):
        integrate_body(bodies, run, b)
