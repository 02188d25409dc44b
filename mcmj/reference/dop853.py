"""The exact reference: SciPy's DOP853 on the body's equations, in plain NumPy.

Shares no code with MuJoCo's path or with the compiled twins.
"""

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from mcmj.core.body import Body, spring_lengths
from mcmj.core.readout import Readout
from mcmj.core.rollout_arguments import Drive
from mcmj.core.trajectory import State, Trajectory
from mcmj.utils.errors import DivergenceError
from mcmj.utils.validation import Array

Signal = Callable[[float], Array]
Push = Callable[[float, Array], Array]

RTOL = 1e-12
SMALLEST_RTOL = 2.3e-14  # SciPy's DOP853 takes no less
EVALUATIONS_PER_STEP = 5000  # give up beyond this many in one control step,
EVALUATIONS_PER_SECOND = 1_000_000  # and this many more in a second
ATOL_SHARE = 1e-3  # absolute tolerance, over the relative one, in units of 1 m and 1 m/s


def accelerations(
    body: Body, positions: Array, velocities: Array, push: Array, rates: Array | None = None
) -> Array:
    """Right-hand side of Eqs. (6) and (7): (N, D) [m/s^2].

    Args:
        push: (N,) forces along the body's direction [N].
        rates: (L,) of the springs [m/s], instead of those of the velocities.
    """
    tail, head = body.springs.T
    gap, closing = positions[head] - positions[tail], velocities[head] - velocities[tail]
    length = np.linalg.norm(gap, axis=1)
    axis = gap / length[:, None]
    x1, x2 = length - body.rest_lengths, (axis * closing).sum(axis=1) if rates is None else rates
    pull = body.k3 * x1**3 + body.k1 * x1 + body.d3 * x2**3 + body.d1 * x2
    force = np.zeros_like(positions)
    np.add.at(force, tail, pull[:, None] * axis)
    np.add.at(force, head, -pull[:, None] * axis)
    for i, share in enumerate(body.direction):
        if share:
            force[:, i] += share * push
    return np.where(body.fixed[:, None], 0.0, force / body.masses[:, None])


def integrate_held(
    body: Body, drive: Drive, readout: Readout, timestep: float, start: State, *, rtol: float
) -> Trajectory:
    """Inputs, offset, forces and feedback held over each control step, as in the loop's law.

    The integrator restarts wherever the held force changes: with feedback, at every step.
    """
    state = np.concatenate([start.positions.ravel(), start.velocities.ravel()])
    recorded = np.empty((drive.steps, body.n_springs))
    k, first_step = 0, None
    while k < drive.steps:
        lengths = spring_lengths(_split(body, state)[0], body.springs)
        push = held_push(body, drive, readout.outputs(lengths), k)
        until = k + _same_until(body, drive, k)
        times = timestep * np.arange(until - k + 1, dtype=np.float64)
        try:
            states, first_step = _solve(body, _constant(push), state, times, rtol, first_step)
        except DivergenceError as error:
            raise _divergence(start.time + k * timestep, body, state).after(k) from error
        positions = states[:-1, : body.positions.size].reshape(-1, *body.positions.shape)
        recorded[k:until] = spring_lengths(positions, body.springs)
        state, k = states[-1], until
    return _trajectory(body, recorded, state, readout, timestep, start)


def integrate_continuous(
    body: Body,
    steps: int,
    readout: Readout,
    timestep: float,
    start: State,
    inputs: Signal | None,
    rtol: float,
) -> Trajectory:
    """Feedback and inputs act continuously: the integrator may take long steps.

    Args:
        inputs: a smooth function of time [s] -> (n_inputs,).
    """

    def push(t: float, positions: Array) -> Array:
        lengths = spring_lengths(positions, body.springs)
        force = body.w_fb @ readout.outputs(lengths)
        return force if inputs is None else force + body.w_in @ inputs(t)

    state = np.concatenate([start.positions.ravel(), start.velocities.ravel()])
    times = start.time + timestep * np.arange(steps + 1, dtype=np.float64)
    states, _ = _solve(body, push, state, times, rtol, None)
    positions = states[:-1, : body.positions.size].reshape(-1, *body.positions.shape)
    lengths = spring_lengths(positions, body.springs)
    return _trajectory(body, lengths, states[-1], readout, timestep, start)


def _constant(push: Array) -> Push:
    return lambda t, positions: push


def _split(body: Body, state: Array) -> tuple[Array, Array]:
    positions, velocities = state.reshape(2, *body.positions.shape)
    return positions, velocities


def held_push(body: Body, drive: Drive, outputs: Array, k: int) -> Array:
    """Force (N,) [N] on every node, along the body's direction, during step k."""
    fed_back = drive.gate * outputs
    if drive.offset is not None:
        fed_back = fed_back + drive.offset[k]
    push = body.w_fb @ fed_back
    if drive.inputs is not None:
        push = push + body.w_in @ drive.inputs[k]
    if drive.forces is not None:
        push = push + drive.forces[min(k, len(drive.forces) - 1)]
    return push


def _same_until(body: Body, drive: Drive, k: int) -> int:
    """Number of steps from k on during which nothing that is held changes."""
    if drive.gate.any() and body.n_outputs:
        return 1
    same = drive.steps - k
    for array in (drive.inputs, drive.offset, drive.forces):
        if array is not None and len(array) > 1:
            changes = np.flatnonzero((array[k + 1 :] != array[k]).any(axis=1))
            same = min(same, int(changes[0]) + 1 if changes.size else same)
    return same


def _solve(
    body: Body,
    push: Push,
    state: Array,
    times: Array,
    rtol: float,
    first_step: float | None,
) -> tuple[Array, float | None]:
    """States (T + 1, 2 D N) at times (T + 1,), and a good first step for the next piece."""

    duration = times[-1] - times[0]
    budget = EVALUATIONS_PER_STEP * (len(times) - 1) + EVALUATIONS_PER_SECOND * duration

    def rhs(t: float, state: Array) -> Array:
        nonlocal budget
        budget -= 1
        if budget < 0 or not np.isfinite(state).all():
            raise _divergence(float(t), body, state)
        positions, velocities = _split(body, state)
        change = accelerations(body, positions, velocities, push(t, positions))
        return np.concatenate([np.where(body.fixed[:, None], 0.0, velocities), change], axis=None)

    duration = times[-1] - times[0]
    with np.errstate(all="ignore"):  # a body that diverges overflows, and is reported below
        solution = solve_ivp(
            rhs,
            (times[0], times[-1]),
            state,
            method="DOP853",
            t_eval=times if len(times) > 2 else None,
            rtol=rtol,
            atol=rtol * ATOL_SHARE,
            first_step=None if first_step is None else min(first_step, duration),
        )
    if not solution.success:
        raise _divergence(float(solution.t[-1]), body, solution.y[:, -1])
    states = solution.y.T if len(times) > 2 else solution.y.T[[0, -1]]
    return states, float(duration) if len(times) == 2 and len(solution.t) == 2 else None


def _divergence(time: float, body: Body, state: Array) -> DivergenceError:
    speed = np.abs(np.nan_to_num(_split(body, state)[1], nan=np.inf)).max(axis=1)
    return DivergenceError(
        "dop853: the body blew up, or is too stiff for an explicit method, at "
        f"t = {time:.6g} s at node {int(speed.argmax())} (adaptive step); try smaller forces, "
        "speeds and readout weights, or MuJoCo's 'discrete' for stiff dampers",
        time=time,
        steps_done=0,
    )


def _trajectory(
    body: Body, lengths: Array, last: Array, readout: Readout, timestep: float, start: State
) -> Trajectory:
    positions, velocities = _split(body, last)
    steps = len(lengths)
    return Trajectory(
        times=start.time + timestep * np.arange(steps, dtype=np.float64),
        lengths=lengths,
        outputs=readout.outputs(lengths),
        final_state=State(positions.copy(), velocities.copy(), start.time + timestep * steps),
    )
