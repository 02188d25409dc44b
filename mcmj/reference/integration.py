"""Reference integrators, sharing no code with MuJoCo's path.

    dop853               SciPy's DOP853 in plain NumPy: the exact solution
    semi_implicit_euler  compiled twin of MuJoCo's Euler:  v += h F/m;  p += h v
    rk4                  compiled twin of MuJoCo's RK4
    leapfrog             compiled twin of the leapfrog (mcmj.core.callbacks.leapfrog): second order
    adaptive_leapfrog    the same in steps as short as the dampers ask for (`twin.adaptive`)
    toolbox_euler        the authors' scheme: spring rates by backward difference,
                         x2 = (l_k - l_{k-1}) / h with l_{-1} = l0; p += h v;  v += h F/m
    toolbox_rk           the same with p += h v + h^2 F/2m, what Runge-Kutta gives for a held force

In the toolbox schemes the output y_k = W_out^T l_k is fed back at step k + 1. Bodies in space, and
those pushed along another direction than x, run by the same schemes in plain NumPy (`plain_steps`).
"""

from dataclasses import replace

import numpy as np

from mcmj.core.body import Body
from mcmj.core.readout import Readout
from mcmj.core.rollout_arguments import Drive, check_drive
from mcmj.core.trajectory import State, Trajectory
from mcmj.reference.dop853 import RTOL, SMALLEST_RTOL, Signal, integrate_continuous, integrate_held
from mcmj.reference.plain_steps import integrate_plain
from mcmj.reference.twin.population import Population, rest
from mcmj.reference.twin.stepping import METHODS as TWINS
from mcmj.utils.errors import UnknownNameError
from mcmj.utils.validation import MOST_STEPS, as_array, require_count, require_number

METHODS = ("dop853", *TWINS)


def integrate(
    body: Body,
    *,
    method: str,
    steps: int | None = None,
    timestep: float = 1e-3,
    inputs: object = None,
    offset: object = None,
    gate: object = None,
    forces: object = None,
    w_out: object = None,
    initial_state: State | None = None,
    rtol: float = RTOL,
) -> Trajectory:
    """Run a body as Simulation.rollout does, from rest or from an initial state.

    Args:
        method: one of METHODS.
        steps, inputs, offset, gate, forces: as for Simulation.rollout.
        timestep: control step and, but for dop853, integration step [s].
        w_out: readout (L, n_outputs), or (L + 1, n_outputs) with a bias in the last row.
        initial_state: where to start; another run's `final_state` continues it.
        rtol: relative tolerance of dop853.

    Returns:
        A trajectory with lengths, outputs and final state.

    Raises:
        DivergenceError: the body blew up.
        InvalidArgumentError, UnknownNameError: an argument out of bounds.
    """
    if method not in METHODS:
        raise UnknownNameError("method", method, METHODS)
    readout = Readout.of(w_out, body.n_springs, body.n_outputs)
    drive = check_drive(
        body,
        steps=steps,
        inputs=inputs,
        offset=offset,
        gate=gate,
        forces=forces,
        closed=w_out is not None,
    )
    require_number("timestep", timestep, 0.0, open_low=True)
    start = _checked_state(body, initial_state)
    if method == "dop853":
        require_number("rtol", rtol, SMALLEST_RTOL, 1e-2)
        return integrate_held(body, drive, readout, timestep, start, rtol=rtol)
    if body.dimensions != 2 or not body.pushed_along_x:
        return integrate_plain(body, drive, readout, method, timestep, start)
    return _integrate_twin(body, drive, readout, method, timestep, start)


def integrate_smooth(
    body: Body,
    *,
    steps: int,
    inputs: Signal | None = None,
    w_out: object = None,
    initial_state: State | None = None,
    rtol: float = RTOL,
) -> Trajectory:
    """DOP853 with feedback and inputs acting continuously, Eq. (6) as written.

    The integrator takes steps as long as the motion is smooth.

    Args:
        steps: samples to record, 1 ms apart.
        inputs: a smooth function of time [s] -> (n_inputs,).
        w_out, initial_state, rtol: as for `integrate`.

    Raises:
        DivergenceError, InvalidArgumentError: as for `integrate`.
    """
    require_count("steps", steps, 1, MOST_STEPS)
    require_number("rtol", rtol, SMALLEST_RTOL, 1e-2)
    readout = Readout.of(w_out, body.n_springs, body.n_outputs)
    return integrate_continuous(
        body, steps, readout, 1e-3, _checked_state(body, initial_state), inputs, rtol
    )


def _integrate_twin(
    body: Body, drive: Drive, readout: Readout, method: str, timestep: float, start: State
) -> Trajectory:
    population = Population([body], [readout], method=method, timestep=timestep)
    population.set_states([start])
    record, done = population.run(drive, 0, drive.steps)
    if done[0] < drive.steps:
        raise population.divergence(0, int(done[0]), drive.steps)
    times = start.time + timestep * np.arange(drive.steps, dtype=np.float64)
    final = replace(population.states[0], time=start.time + drive.steps * timestep)
    return Trajectory(times, record.lengths[0], record.outputs[0], final_state=final)


def _checked_state(body: Body, state: State | None) -> State:
    if state is None:
        return rest(body)
    shape = body.positions.shape
    as_array("initial_state.positions", state.positions, shape)
    as_array("initial_state.velocities", state.velocities, shape)
    if state.history is not None:
        as_array("initial_state.history", state.history, (body.n_nodes, 3 * body.dimensions + 1))
    return state
