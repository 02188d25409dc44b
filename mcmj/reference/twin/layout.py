"""Bodies, readouts and drives in the arrays that the compiled kernels read."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from mcmj.core.body import Body, damper_reach
from mcmj.core.readout import Readout
from mcmj.core.rollout_arguments import Drive
from mcmj.core.trajectory import State
from mcmj.reference.twin.forces import Bodies
from mcmj.reference.twin.packs import Packs
from mcmj.reference.twin.stepping import KernelDrive, KernelState, Record
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array

PACK = 4  # bodies of one topology side by side in a vector register


def to_bodies(bodies: Sequence[Body], readouts: Sequence[object]) -> Bodies:
    """Bodies of any topology but the same channels -> kernel layout, padded to the largest."""
    count = len(bodies)
    nodes = max(_round_up(body.n_nodes) for body in bodies)
    width = max(_round_up(body.n_springs) for body in bodies)
    n_in, n_out = bodies[0].n_inputs, bodies[0].n_outputs
    if any((body.n_inputs, body.n_outputs) != (n_in, n_out) for body in bodies):
        raise InvalidArgumentError("bodies", "the same numbers of channels", "different ones")
    layout = Bodies(
        nodes=np.array([body.n_nodes for body in bodies]),
        springs=np.array([body.n_springs for body in bodies]),
        ends=_aligned((count, 2 * width), np.int32),
        turns=_aligned((count, 3 * width), np.int32),
        laws=_aligned((count, 5 * width)),
        brakes=_aligned((count, 2 * width)),
        mobility=_aligned((count, nodes)),
        channels=_aligned((count, (n_in + n_out) * nodes)),
        w_out=_aligned((count, n_out * width)),
        bias=_aligned((count, n_out)),
    )
    for b, body in enumerate(bodies):
        _fill(layout, b, body, nodes, width)
    return with_readouts(layout, bodies, readouts)


def with_readouts(layout: Bodies, bodies: Sequence[Body], readouts: Sequence[object]) -> Bodies:
    """The layout of these bodies, with other readouts."""
    count, n_out = layout.bias.shape
    width = layout.laws.shape[1] // 5
    new = layout._replace(w_out=_aligned(layout.w_out.shape), bias=_aligned((count, n_out)))
    for b, (body, value) in enumerate(zip(bodies, readouts, strict=True)):
        readout = Readout.of(value, body.n_springs, n_out)
        new.w_out[b].reshape(n_out, width)[:, : body.n_springs] = readout.weights.T
        new.bias[b] = readout.bias
    return new


def _fill(layout: Bodies, b: int, body: Body, nodes: int, width: int) -> None:
    """Body b's rows, readout excepted."""
    n, m = body.n_nodes, body.n_springs
    # padding springs get the ends of spring 0 and no stiffness: finite, and no force
    ends = np.repeat(body.springs[:1], width, axis=0)
    ends[:m] = body.springs
    laws = np.zeros((5, width))
    laws[:, :m] = body.rest_lengths, body.k1, body.k3, body.d1, body.d3
    brakes = np.zeros((2, width))
    brakes[:, :m] = damper_reach(body) * (body.d1, 3.0 * body.d3)
    order = _summation_order(body)
    place = 4 * (order // 4) + np.array([0, 2, 1, 3])[order % 4]  # as find_pulls stores them
    layout.ends[b] = 4 * _in_blocks(ends.T)
    layout.turns[b, : 3 * m] = 2 * np.column_stack([place, body.springs[order]]).ravel()
    layout.laws[b] = _in_blocks(laws)
    layout.brakes[b] = _in_blocks(brakes)
    layout.mobility[b, :n] = _mobility(body)
    layout.channels[b].reshape(-1, nodes)[:, :n] = np.hstack([body.w_in, body.w_fb]).T


def to_packs(bodies: Sequence[Body], readouts: Sequence[object]) -> Packs:
    """Bodies of one topology -> packs of four; the last is repeated to fill the last pack."""
    springs = bodies[0].springs
    if any(not np.array_equal(body.springs, springs) for body in bodies):
        raise InvalidArgumentError("bodies", "one topology", "different springs")
    spare = -len(bodies) % PACK
    padded = [*bodies, *[bodies[-1]] * spare]
    pairs = zip(bodies, readouts, strict=True)
    checked = [Readout.of(value, len(springs), body.n_outputs) for body, value in pairs]
    checked += [checked[-1]] * spare
    odd = len(springs) % 2  # readouts are summed two springs at a time
    laws = [np.column_stack([b.rest_lengths, b.k1, b.k3, b.d1, b.d3]) for b in padded]
    return Packs(
        ends=np.array(springs, dtype=np.int64, order="C"),
        laws=_pack(laws),
        mobility=_pack([_mobility(b) for b in padded]),
        channels=_pack([np.hstack([b.w_in, b.w_fb]).T for b in padded]),
        w_out=_pack([np.pad(r.weights.T, ((0, 0), (0, odd))) for r in checked]),
        bias=_pack([r.bias for r in checked]),
    )


def to_schedule(drive: Drive, start: int, stop: int) -> KernelDrive:
    """Steps start .. stop - 1 of a drive; what is shared or absent takes no room."""

    def part(values: Array | None) -> Array:
        if values is None:
            return np.zeros((1, 1, 0))
        rows = values if values.shape[-2] == 1 else values[..., start:stop, :]
        return np.ascontiguousarray(rows if rows.ndim == 3 else rows[None])

    return KernelDrive(part(drive.inputs), part(drive.offset), part(drive.forces), drive.gate[None])


def to_kernel_state(bodies: Sequence[Body], states: Sequence[State]) -> KernelState:
    """States of several bodies.

    Without memory, lengths one step ago are the rest lengths, and the leapfrog starts anew; as
    it does where the velocities are not those that the history belongs to.
    """
    nodes = max(body.n_nodes for body in bodies)
    width = max(_round_up(body.n_springs) for body in bodies)
    positions = np.zeros((len(bodies), nodes, 2))
    velocities = np.zeros_like(positions)
    lengths = _aligned((len(bodies), width))
    outputs = np.zeros((len(bodies), bodies[0].n_outputs))
    history = np.full((len(bodies), nodes, 5), np.nan)
    for b, (body, state) in enumerate(zip(bodies, states, strict=True)):
        positions[b, : body.n_nodes] = state.positions
        velocities[b, : body.n_nodes] = state.velocities
        before = state.previous_lengths
        lengths[b, : body.n_springs] = body.rest_lengths if before is None else before
        if state.pending_output is not None:
            outputs[b] = state.pending_output
        past = state.history
        if past is not None and np.array_equal(past[:, :2], state.velocities):
            history[b, : body.n_nodes] = past[:, 2:]
    return KernelState(positions, velocities, lengths, outputs, history)


def empty_record(bodies: Sequence[Body], steps: int, *, lengths: bool) -> Record:
    """Room for `steps` steps, lengths only if asked for.

    Not filled: the kernels' threads touch the memory first, which is most of its cost.
    """
    longest = max(body.n_springs for body in bodies)
    return Record(
        np.empty((len(bodies), steps if lengths else 0, longest)),
        np.empty((len(bodies), steps, bodies[0].n_outputs)),
    )


def blank_unused(record: Record, bodies: Sequence[Body], done: npt.NDArray[np.int64]) -> None:
    """NaN where a body has no such spring, or blew up before."""
    for b, body in enumerate(bodies):
        record.lengths[b, :, body.n_springs :] = np.nan
        record.lengths[b, done[b] :] = np.nan
        record.outputs[b, done[b] :] = np.nan


def _mobility(body: Body) -> Array:
    return np.where(body.fixed, 0.0, 1.0 / body.masses)


def _summation_order(body: Body) -> npt.NDArray[np.int64]:
    """Order of springs in which near neighbours share no node (a greedy edge colouring)."""
    taken = np.zeros((body.n_nodes, 2 * body.n_springs + 1), dtype=bool)
    colour = np.empty(body.n_springs, dtype=np.int64)
    for j, (a, b) in enumerate(body.springs):
        colour[j] = np.argmin(taken[a] | taken[b])
        taken[a, colour[j]] = taken[b, colour[j]] = True
    return np.argsort(colour, kind="stable")


def _round_up(count: int) -> int:
    """To a multiple of 8: kernels take 4 at a time, and sum two sets of 4 side by side."""
    return (count + 7) // 8 * 8


def _aligned(shape: tuple[int, ...], dtype: npt.DTypeLike = np.float64) -> np.ndarray:
    """Zeros that start on a cache line, so that no vector load straddles two."""
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    raw = np.zeros(size + 64, np.uint8)
    first = -raw.ctypes.data % 64
    return raw[first : first + size].view(dtype).reshape(shape)


def _in_blocks(values: np.ndarray) -> np.ndarray:
    """(rows, 4 b) -> flat, block by block: 4 of row 0, 4 of row 1, .."""
    return values.reshape(len(values), -1, 4).swapaxes(0, 1).ravel()


def _pack(values: Sequence[Array]) -> Array:
    """One array per body -> (packs, size of one x 4), the body innermost."""
    stacked = np.array(values).reshape(len(values) // PACK, PACK, -1)
    packed = _aligned((len(stacked), PACK * stacked.shape[2]))
    packed.reshape(len(stacked), -1, PACK)[:] = stacked.swapaxes(1, 2)
    return packed
