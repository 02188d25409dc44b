"""The fixed-step references in plain NumPy: slow, for bodies that the compiled twins do not know.

Those are bodies in space, and bodies pushed along another direction than x. The schemes are those
of `mcmj.reference.integration`; the leapfrog is that of `mcmj.core.callbacks.leapfrog`, the
adaptive one that of `mcmj.reference.twin.adaptive`.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mcmj.core.body import Body, damper_reach, spring_lengths
from mcmj.core.readout import Readout
from mcmj.core.rollout_arguments import Drive
from mcmj.core.trajectory import State, Trajectory
from mcmj.reference.dop853 import accelerations, held_push
from mcmj.reference.twin.adaptive import MOST_PARTS, TOO_FAST
from mcmj.utils.errors import DivergenceError
from mcmj.utils.validation import Array

TOOLBOX = ("toolbox_euler", "toolbox_rk")
Step = Callable[[Body, State, Array, float], State]


def integrate_plain(
    body: Body, drive: Drive, readout: Readout, method: str, timestep: float, start: State
) -> Trajectory:
    """Run a body by one of the methods but dop853.

    Raises:
        DivergenceError: the body blew up.
    """
    steps = drive.steps
    lengths, outputs = np.empty((steps, body.n_springs)), np.empty((steps, body.n_outputs))
    velocities = np.where(body.fixed[:, None], 0.0, start.velocities)
    state = replace(start, velocities=velocities)
    fed_back = np.zeros(body.n_outputs) if start.pending_output is None else start.pending_output
    for k in range(steps):
        with np.errstate(all="ignore"):  # a body that diverges overflows, and is reported below
            lengths[k] = spring_lengths(state.positions, body.springs)
            outputs[k] = readout.outputs(lengths[k])
            push = held_push(body, drive, fed_back if method in TOOLBOX else outputs[k], k)
            after = STEPS[method](body, state, push, timestep)
        if not (np.isfinite(after.positions).all() and np.isfinite(after.velocities).all()):
            raise _divergence(state, method, timestep, start.time, k)
        state, fed_back = after, outputs[k]
    end = replace(state, time=start.time + steps * timestep, pending_output=fed_back)
    times = start.time + timestep * np.arange(steps, dtype=np.float64)
    return Trajectory(times, lengths, outputs, final_state=end)


def _euler(body: Body, state: State, push: Array, h: float) -> State:
    p, v = state.positions, state.velocities
    v = v + h * accelerations(body, p, v, push)
    return State(p + h * v, v)


def _rk4(body: Body, state: State, push: Array, h: float) -> State:
    p, v1 = state.positions, state.velocities
    a1 = accelerations(body, p, v1, push)
    v2 = v1 + h / 2 * a1
    a2 = accelerations(body, p + h / 2 * v1, v2, push)
    v3 = v1 + h / 2 * a2
    a3 = accelerations(body, p + h / 2 * v2, v3, push)
    v4 = v1 + h * a3
    a4 = accelerations(body, p + h * v3, v4, push)
    moved, kicked = v1 + 2 * v2 + 2 * v3 + v4, a1 + 2 * a2 + 2 * a3 + a4
    return State(p + h / 6 * moved, v1 + h / 6 * kicked)


def _memory(state: State) -> Array | None:
    """The leapfrogs' `history` (v, V, w, f) side by side, if it belongs to the velocities."""
    past, v = state.history, state.velocities
    return past if past is not None and np.array_equal(past[:, : v.shape[1]], v) else None


def _leapfrog(body: Body, state: State, push: Array, h: float) -> State:
    p, v, past, d = state.positions, state.velocities, _memory(state), body.dimensions
    if past is None:
        seen, half, before, share = v, v, np.zeros_like(push), 0.5
    else:
        seen, half, before, share = past[:, d : 2 * d], past[:, 2 * d : 3 * d], past[:, -1], 1.0
    by_springs = accelerations(body, p, seen, np.zeros_like(push))
    total = accelerations(body, p, seen, push)
    mean = accelerations(body, p, seen, (push + before) / 2)
    kick = h * (mean + (share - 1.0) * by_springs)
    half = half + kick
    v = half + h / 2 * total
    history = np.column_stack([v, half + kick / 2, half, push])
    return State(p + h * half, v, history=history)


def _adaptive_leapfrog(body: Body, state: State, push: Array, h: float) -> State:
    past, d = _memory(state), body.dimensions
    p, v = state.positions, state.velocities if past is None else past[:, d : 2 * d]
    if h * _damper_rate(body, p, v) <= TOO_FAST:
        return _leapfrog(body, state, push, h)
    half, rest, part = v, h, 0.0
    for _ in range(MOST_PARTS):
        left = max(1.0, np.ceil(rest * _damper_rate(body, p, v) / TOO_FAST))
        before, part = part, rest / left
        a = accelerations(body, p, v, push)
        half = half + (before + part) / 2 * a
        p, v = p + part * half, half + part / 2 * a
        rest = rest - part if left > 1.0 else 0.0
        if rest <= 0.0:
            break
    a = accelerations(body, p, v, push)
    v = half + part / 2 * a if rest == 0.0 else np.full_like(v, np.nan)
    return State(p, v, history=np.column_stack([v, v, v - h / 2 * a, push]))


def _damper_rate(body: Body, p: Array, v: Array) -> float:
    tail, head = body.springs.T
    gap, closing = p[head] - p[tail], v[head] - v[tail]
    x2 = (gap * closing).sum(axis=1) / np.linalg.norm(gap, axis=1)
    return float((damper_reach(body) * (body.d1 + 3.0 * body.d3 * x2 * x2)).max())


def _toolbox(body: Body, state: State, push: Array, h: float, shift: float) -> State:
    p, v, before = state.positions, state.velocities, state.previous_lengths
    lengths = spring_lengths(p, body.springs)
    rates = (lengths - (body.rest_lengths if before is None else before)) / h
    a = accelerations(body, p, v, push, rates)
    return State(p + h * (v + shift * h * a), v + h * a, previous_lengths=lengths)


STEPS: dict[str, Step] = {
    "semi_implicit_euler": _euler,
    "rk4": _rk4,
    "leapfrog": _leapfrog,
    "adaptive_leapfrog": _adaptive_leapfrog,
    "toolbox_euler": lambda body, state, push, h: _toolbox(body, state, push, h, 0.0),
    "toolbox_rk": lambda body, state, push, h: _toolbox(body, state, push, h, 0.5),
}


def _divergence(
    state: State, method: str, timestep: float, start: float, k: int
) -> DivergenceError:
    node = int(np.abs(state.velocities).max(axis=1).argmax())
    time = start + k * timestep
    return DivergenceError(
        f"the simulation blew up after t = {time:.6g} s at node {node}, method {method}, step "
        f"{1e3 * timestep:g} ms; try a smaller step, or smaller forces and readout weights",
        time=time,
        steps_done=k,
    )
