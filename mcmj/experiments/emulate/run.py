"""A nonlinear spring becomes another system by static feedback (Hauser et al. 2012, section 3).

The error is that of the body's states against the target system by DOP853: RMS distance over
a run, over the target's RMS radius. `order` is the slope of log error over log step.

What limits it: the integrator's own order (1 Euler and the implicit ones, which do not know the
feedback's derivative; 2 leapfrog; 4 RK4); an input is held over a step, which costs order 2 if
sampled in its middle, order 1 if at its start; rounding, for x1 = l - l0 has the rounding of l;
and, above all, how well K knows p and q.
"""

import warnings
from functools import partial

import numpy as np
from scipy.integrate import solve_ivp

from mcmj.analysis.emulation import emulation_body
from mcmj.experiments.blow_ups import or_lost
from mcmj.experiments.emulate.config import REPORTED, Config
from mcmj.experiments.emulate.result import Cell, Result
from mcmj.experiments.emulate.systems import System, mismatched, system, user_system
from mcmj.metrics.convergence import observed_order
from mcmj.simulation.simulation import Simulation
from mcmj.utils.errors import McmjError, StabilityWarning
from mcmj.utils.progress import OnSteps
from mcmj.utils.validation import Array

RTOL = 1e-13


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Emulate every target under every integrator and step."""
    systems = {name: system(name) for name in config.targets}
    if config.g is not None:
        systems["user"] = user_system(config.g)
    cells, orbits = {}, {}
    for name, one in systems.items():
        cells[name] = _cells(config, one)
        states = emulate(one, config.integrators[-1], REPORTED, config.horizon)
        orbits[name] = (states, reference(one, REPORTED, config.horizon))
        on_steps(1)
    driven = systems.get("driven_duffing")
    return Result(
        config,
        cells,
        {t: {m: observed_order({t: cells[t]}, m) for m in config.integrators} for t in cells},
        orbits,
        _cells(config, driven, sample_at=0.0) if driven else {},
        {size: _mismatch_error(config, size) for size in config.mismatches},
    )


def emulate(
    one: System, integrator: str, step_ms: float, horizon: float, *, sample_at: float = 0.5
) -> Array:
    """States (T, n) of the body at t_k in MuJoCo, as the target has them.

    Args:
        sample_at: the input of a step is u at this share of it.

    Raises:
        DivergenceError: the body blew up.
        McmjError: a mass came to the wall, where the line it moves on ends.
    """
    step, free = 1e-3 * step_ms, slice(1, None)  # node 0 is the wall
    body = emulation_body(len(one.positions))
    with warnings.catch_warnings():  # an unstable G is meant to be
        warnings.simplefilter("ignore", StabilityWarning)
        sim = Simulation(body, springs=one.law, integrator=integrator, timestep=step)
    positions, velocities = body.positions.copy(), np.zeros_like(body.positions)
    positions[free, 0] += one.positions
    velocities[free, 0] = one.velocities
    sim.set_state(positions, velocities)
    count = round(horizon / step)
    inputs = None
    if one.drive is not None:
        inputs = one.drive(step * (np.arange(count, dtype=np.float64) + sample_at))[:, None]
    ran = sim.rollout(count, inputs=inputs, record=("lengths", "velocities"))
    if ran.get("lengths").min() < 0.1 * body.rest_lengths.min():
        raise McmjError("a mass came near the wall: choose a G whose x1 stays far above -100")
    x1, x2 = ran.get("lengths") - body.rest_lengths, ran.get("velocities")[:, free, 0]
    return x1 if one.states == "x" else np.hstack([x1, x2])


def reference(one: System, step_ms: float, horizon: float) -> Array:
    """States (T, n) of the target at t_k by DOP853."""
    step = 1e-3 * step_ms
    times = step * np.arange(round(horizon / step))
    solution = solve_ivp(
        one.rhs, (0.0, times[-1]), one.start, "DOP853", t_eval=times, rtol=RTOL, atol=RTOL
    )
    if not solution.success:
        raise McmjError(f"the target system cannot be integrated: {solution.message}")
    found: Array = solution.y.T
    return found


def emulation_error(states: Array, wanted: Array) -> float:
    """RMS distance of states (T, n) from the wanted ones, over the RMS radius of those."""
    spread = ((wanted - wanted.mean(axis=0)) ** 2).sum(axis=1).mean()
    return float(np.sqrt(((states - wanted) ** 2).sum(axis=1).mean() / spread))


def _cells(config: Config, one: System, *, sample_at: float = 0.5) -> dict[str, dict[float, Cell]]:
    wanted = {step: reference(one, step, config.horizon) for step in config.steps_ms}

    def error(integrator: str, step: float) -> float:
        states = emulate(one, integrator, step, config.horizon, sample_at=sample_at)
        return emulation_error(states, wanted[step])

    return {
        name: {step: Cell(or_lost(partial(error, name, step), np.inf)) for step in config.steps_ms}
        for name in config.integrators
    }


def _mismatch_error(config: Config, size: float) -> float:
    one = mismatched(size)
    wanted = reference(one, REPORTED, config.horizon)
    return emulation_error(emulate(one, "RK4", REPORTED, config.horizon), wanted)
