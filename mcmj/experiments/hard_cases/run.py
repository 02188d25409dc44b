"""Hard cases: the largest stable step of each integrator, found by bisection and predicted.

Each case is a body with a start that some integrator cannot bear at 1 ms. A step is stable
here if the run stays finite, no spring gets further from its rest length than OVERSHOOT
times the body and the exact motion, and no length oscillates from step to step for ALTERNATIONS
steps by more than NOISE of the largest motion: cubic dampers bound that oscillation, so that a run
may survive as noise, which is not stable. A stable run may still be inaccurate. No step
is tried in which the motion is not resolved: in which the fastest change of a length would be half
the mean length of a spring.

Beside it stand predictions: at rest, for motions of vanishing size (`stability_limit`), and the
bracket along the exact motion (`step_bracket`).
"""

import math
import warnings
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp

from mcmj.core.body import Body, spring_lengths
from mcmj.core.readout import Readout
from mcmj.experiments.blow_ups import or_lost
from mcmj.experiments.hard_cases.bodies import CASES, HardCase
from mcmj.experiments.hard_cases.config import Config
from mcmj.experiments.hard_cases.result import Result, Row
from mcmj.reference.dop853 import accelerations
from mcmj.simulation.simulation import Simulation
from mcmj.simulation.stepsize.along_motion import KnownMotion, step_bracket
from mcmj.simulation.stepsize.limit import stability_limit
from mcmj.utils.errors import DivergenceError, StabilityWarning
from mcmj.utils.progress import OnSteps
from mcmj.utils.validation import Array

OVERSHOOT = 10.0
NOISE = 1e-4  # of the largest motion
ALTERNATIONS = 12
SAMPLES, CLOSED_SAMPLES = 90, 30  # of the exact motion; a closed loop's limits take long
LEAST_STEPS = 400  # of a run: time for a slow growth
LONGEST = 1.0  # s: no longer step is tried


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Bisect and predict every case under every integrator."""
    rows, amplitudes = [], {}
    for name in config.cases:
        case = CASES[name](config.seed)
        motion = exact_motion(case, config.duration)
        x1, x2 = amplitudes_of(case.body, motion)
        amplitudes[name] = (float(x1.max()), float(x2.max()))
        for integrator in config.integrators:
            rows.append(_row(config, name, integrator, motion))
            on_steps(1)
    return Result(config, tuple(rows), amplitudes)


def _row(config: Config, name: str, integrator: str, motion: KnownMotion) -> Row:
    case = CASES[name](config.seed)
    body = case.body
    x1, x2 = amplitudes_of(body, motion)
    reach = OVERSHOOT * (np.ptp(body.positions, axis=0).max() + x1.max())
    lengths = spring_lengths(body.positions, body.springs)
    resolved = min(LONGEST, float(lengths.mean() / 2 / x2.max()))

    def stable(step: float) -> bool:
        wanted = math.ceil(config.duration / step)
        steps = min(config.most_steps, max(LEAST_STEPS, wanted))
        return is_stable(case, integrator, step, steps, reach)

    samples = CLOSED_SAMPLES if case.w_out is not None else SAMPLES
    low, high = step_bracket(body, integrator, motion.thinned(samples), w_out=case.w_out)
    return Row(
        name,
        integrator,
        measured=bisect(stable, min(low, resolved), config.precision, resolved),
        at_rest=stability_limit(body, integrator, w_out=case.w_out),
        low=low,
        high=high,
        resolved=resolved,
    )


def bisect(
    stable: Callable[[float], bool], guess: float, precision: float, longest: float = LONGEST
) -> float:
    """Largest stable step [s]: doubled or halved from a guess to a bracket, then bisected.

    Args:
        longest: that is tried [s]; infinity if it is stable.
    """
    low = high = guess
    if stable(guess):
        while True:
            if high >= longest:
                return math.inf
            high = min(2.0 * high, longest)
            if not stable(high):
                break
            low = high
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
    """Whether a run stays finite, every spring within `reach` [m], and all smooth."""
    with np.errstate(all="ignore"):  # speeds of 1e200 m/s
        lengths = or_lost(lambda: simulate(case, integrator, step, steps), None)
        if lengths is None or not (np.abs(lengths - case.body.rest_lengths) <= reach).all():
            return False
    return noise(lengths) <= NOISE * float(np.abs(lengths - lengths[0]).max())


def noise(lengths: Array) -> float:
    """Largest amplitude [m] in lengths (T, L) of an oscillation (-1)^k u over ALTERNATIONS steps.

    One that falls below half in these steps dies away, and is none. Its third difference is
    -8 (-1)^k u, that of a smooth motion of third order in the step.
    """
    changes = np.diff(lengths, n=3, axis=0) / 8
    turns = np.cumsum(changes[1:] * changes[:-1] < 0, axis=0)
    lasting: npt.NDArray[np.bool_] = turns[ALTERNATIONS:] - turns[:-ALTERNATIONS] == ALTERNATIONS
    sizes = np.abs(changes)
    before, after = sizes[1:-ALTERNATIONS], sizes[ALTERNATIONS + 1 :]
    return float((after * (lasting & (after > before / 2))).max(initial=0.0))


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


def exact_motion(case: HardCase, duration: float) -> KnownMotion:
    """The motion at implicit Radau's own steps, with continuous feedback, as Eq. (6) is written.

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
    return KnownMotion(solution.t, states[:, 0], states[:, 1])


def amplitudes_of(body: Body, motion: KnownMotion) -> tuple[Array, Array]:
    """Largest |x1| [m] and |x2| [m/s] of each spring (L,) in a motion."""
    lengths = np.stack([spring_lengths(where, body.springs) for where in motion.positions])
    largest = np.abs(lengths - body.rest_lengths).max(axis=0)
    return largest, np.abs(motion.rates(body)).max(axis=0)
