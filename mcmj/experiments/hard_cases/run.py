"""Hard cases: the largest stable step of each integrator, found by bisection and predicted.

Each case is a body with a start that some integrator cannot bear at 1 ms. A step is stable
here if the run stays finite and no spring gets further from its rest length than OVERSHOOT
times the body and the exact motion; it may still be inaccurate. Beside it stand three
predictions of `steplimit.stability_limit`: at rest, for motions of vanishing size; safe, where
errors on top of the exact motion do not grow (tangents at each spring's largest elongation and
rate); and blow-up, where the motion itself grows (secants there).
"""

import math
import warnings
from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from mcmj.core.body import spring_lengths
from mcmj.core.readout import Readout
from mcmj.experiments.blow_ups import or_lost
from mcmj.experiments.hard_cases.bodies import CASES, HardCase
from mcmj.experiments.hard_cases.config import Config
from mcmj.experiments.hard_cases.result import Result, Row
from mcmj.reference.dop853 import accelerations
from mcmj.simulation.simulation import Simulation
from mcmj.simulation.stepsize.limit import stability_limit
from mcmj.utils.errors import DivergenceError, StabilityWarning
from mcmj.utils.progress import OnSteps
from mcmj.utils.validation import Array

OVERSHOOT = 10.0
LEAST_STEPS = 400  # of a run: time for a slow growth
LONGEST = 1.0  # s: no longer step is tried


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Bisect and predict every case under every integrator."""
    rows, amplitudes = [], {}
    for name in config.cases:
        case = CASES[name](config.seed)
        x1, x2 = exact_amplitudes(case, config.duration)
        amplitudes[name] = (float(x1.max()), float(x2.max()))
        for integrator in config.integrators:
            rows.append(_row(config, name, case, integrator, x1, x2))
            on_steps(1)
    return Result(config, tuple(rows), amplitudes)


def _row(config: Config, name: str, case: HardCase, integrator: str, x1: Array, x2: Array) -> Row:
    reach = OVERSHOOT * (np.ptp(case.body.positions, axis=0).max() + x1.max())

    def predicted(*, elongation: object, speed: object, secant: bool = False) -> float:
        return stability_limit(
            case.body,
            integrator,
            elongation=elongation,
            speed=speed,
            secant=secant,
            w_out=case.w_out,
        )

    def stable(step: float) -> bool:
        wanted = math.ceil(config.duration / step)
        steps = min(config.most_steps, max(LEAST_STEPS, wanted))
        return is_stable(case, integrator, step, steps, reach)

    blow_up = predicted(elongation=x1, speed=x2, secant=True)
    return Row(
        name,
        integrator,
        measured=bisect(stable, min(blow_up, 0.01), config.precision),
        at_rest=predicted(elongation=0.0, speed=0.0),
        safe=predicted(elongation=x1, speed=x2),
        blow_up=blow_up,
    )


def bisect(stable: Callable[[float], bool], guess: float, precision: float) -> float:
    """Largest stable step [s]: doubled or halved from a guess to a bracket, then bisected."""
    low = high = guess
    if stable(guess):
        while stable(high := 2.0 * high):
            low = high
            if high >= LONGEST:
                return math.inf
    else:
        while not stable(low := 0.5 * low):
            high = low
            if low < 1e-9:
                return 0.0
    while high > (1.0 + precision) * low:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low


def is_stable(case: HardCase, integrator: str, step: float, steps: int, reach: float) -> bool:
    """Whether a run stays finite and every spring within `reach` [m] of its rest length."""
    with np.errstate(over="ignore"):  # speeds of 1e200 m/s
        lengths = or_lost(lambda: simulate(case, integrator, step, steps), np.inf)
    return bool((np.abs(lengths - case.body.rest_lengths) <= reach).all())


def simulate(case: HardCase, integrator: str, step: float, steps: int) -> Array:
    """Lengths (T, L) [m] of a run in MuJoCo; says nothing of steps known to be too long.

    Raises:
        DivergenceError: it blew up.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StabilityWarning)
        simulation = Simulation(case.body, w_out=case.w_out, timestep=step, integrator=integrator)
    simulation.set_state(velocities=case.velocities)
    return simulation.rollout(steps, forces=case.forces, record=("lengths",)).get("lengths")


def exact_amplitudes(case: HardCase, duration: float) -> tuple[Array, Array]:
    """Largest |x1| [m] and |x2| [m/s] of each spring (L,) in the motion, by implicit Radau.

    With continuous feedback, as Eq. (6) is written.

    Raises:
        DivergenceError: Radau fails, or the body itself blows up.
    """
    body = case.body
    readout = Readout.of(case.w_out, body.n_springs, body.n_outputs)

    def rhs(t: float, state: Array) -> Array:
        positions, velocities = state.reshape(2, -1, 2)
        lengths = spring_lengths(positions, body.springs)
        push = case.forces + body.w_fb @ readout.outputs(lengths)
        change = accelerations(body, positions, velocities, push)
        return np.concatenate([velocities, change], axis=None)

    start = np.concatenate([body.positions, case.velocities], axis=None)
    solution = solve_ivp(rhs, (0.0, duration), start, "Radau", rtol=1e-5, atol=1e-8)
    if not solution.success:
        raise DivergenceError(f"Radau: {solution.message}", float(solution.t[-1]), 0)
    states = solution.y.T.reshape(-1, 2, body.n_nodes, 2)
    gaps = states[:, :, body.springs[:, 1]] - states[:, :, body.springs[:, 0]]
    lengths = np.linalg.norm(gaps[:, 0], axis=-1)
    rates = (gaps[:, 0] * gaps[:, 1]).sum(axis=-1) / np.maximum(lengths, np.finfo(float).tiny)
    return np.abs(lengths - body.rest_lengths).max(axis=0), np.abs(rates).max(axis=0)
