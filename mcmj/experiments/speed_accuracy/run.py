"""Speed against error: every integrator on several bodies, against DOP853.

Each body is kicked and pulled by constant forces, loop open. The error is the relative
position error |p - p*| / |p* - p(0)| at a horizon, p* by DOP853; the cost is that of a simulated
second, as microseconds of the processor and as a ratio to MuJoCo's Euler at 1 ms, measured in
turns: of steps from rest, or of the whole run where a method takes a step in as many parts as the
motion asks for.
"""

import time
from collections.abc import Callable
from functools import partial

import numpy as np

from mcmj.core.body import Body
from mcmj.core.trajectory import State
from mcmj.experiments.speed_accuracy.attractor import attractor_errors
from mcmj.experiments.speed_accuracy.config import BODIES, Config
from mcmj.experiments.speed_accuracy.methods import adaptive, final_state, moving, stepping
from mcmj.experiments.speed_accuracy.result import Cell, Result
from mcmj.metrics.convergence import observed_order
from mcmj.mjcf.bundled import body_path
from mcmj.mjcf.read import from_mjcf
from mcmj.reference.integration import integrate
from mcmj.utils.errors import DivergenceError
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream
from mcmj.utils.timing import interleaved_seconds
from mcmj.utils.validation import Array

BASE = "mujoco_Euler"
TWIN_FACTOR = 20  # of steps to time: they are so much faster than MuJoCo
TIGHTER = 5e-13  # relative tolerance: with less, stiff springs drown in rounding


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Measure every body."""
    cells, consistency = {}, {}
    for name in config.bodies:
        cells[name], consistency[name] = _run_body(config, BODIES[name](config.seed))
        on_steps(1)
    orders = {m: None if adaptive(m) else observed_order(cells, m) for m in config.methods}
    attractor = {}
    if config.attractor:
        attractor = attractor_errors(from_mjcf(body_path("general"))[0], seed=0)
    return Result(config, cells, orders, consistency, attractor)


def _run_body(config: Config, body: Body) -> tuple[dict[str, dict[float, Cell]], float]:
    start = _kicked(body, config)
    forces = stream(config.seed, "forces").uniform(-config.force, config.force, body.n_nodes)
    goals = [_reference(body, start, forces, t, 1e-12) for t in config.horizons]
    tighter = _reference(body, start, forces, config.horizons[-1], TIGHTER)
    costs = _costs_per_step(config, body, start, forces)
    cells: dict[str, dict[float, Cell]] = {}
    for method in config.methods:
        cells[method] = {}
        for step_ms in config.steps_ms:
            end_after = partial(final_state, body, method, step_ms, start=start, forces=forces)
            errors, length_error = _errors(config, body, step_ms, end_after, goals)
            per_second = 1e3 / step_ms  # steps
            cells[method][step_ms] = Cell(
                position_errors=errors,
                length_error=length_error,
                us_per_second=costs[method, step_ms] * per_second * 1e6,
                cost_ratio=costs[method, step_ms] / costs[BASE, step_ms] / step_ms,
            )
    return cells, _relative(goals[-1].positions, tighter.positions, body.positions)


def _kicked(body: Body, config: Config) -> State:
    rng = stream(config.seed, "initial_state")
    speeds = rng.uniform(-config.speed, config.speed, body.positions.shape)
    return State(body.positions, np.where(body.fixed[:, None], 0.0, speeds))


def _reference(body: Body, start: State, forces: Array, horizon: float, rtol: float) -> State:
    run = integrate(
        body,
        method="dop853",
        steps=1,
        timestep=horizon,
        forces=forces,
        initial_state=start,
        rtol=rtol,
    )
    assert run.final_state is not None
    return run.final_state


def _errors(
    config: Config,
    body: Body,
    step_ms: float,
    end_after: Callable[[int], State],
    goals: list[State],
) -> tuple[tuple[float, ...], float]:
    """Relative position errors at the horizons, and the length error at the last one."""
    errors = []
    length_error = np.inf
    for horizon, goal in zip(config.horizons, goals, strict=True):
        try:
            end = end_after(round(1e3 * horizon / step_ms))
        except DivergenceError:
            errors.append(np.inf)
            continue
        errors.append(_relative(end.positions, goal.positions, body.positions))
        found, wanted = (np.diff(s.positions[body.springs], axis=1)[:, 0] for s in (end, goal))
        gaps = [np.linalg.norm(g, axis=1) for g in (found, wanted)]
        length_error = float(
            np.linalg.norm(gaps[0] - gaps[1]) / np.linalg.norm(gaps[1] - body.rest_lengths)
        )
    return tuple(errors), length_error


def _relative(found: Array, goal: Array, origin: Array) -> float:
    with np.errstate(over="ignore"):
        error = float(np.linalg.norm(found - goal) / np.linalg.norm(goal - origin))
    return error if np.isfinite(error) else np.inf


def _costs_per_step(
    config: Config, body: Body, start: State, forces: Array
) -> dict[tuple[str, float], float]:
    """Median processor seconds of a step by method and step [ms], nothing recorded, in turns."""
    count = max(20, 30_000 // body.n_springs)
    works, cells = {}, []
    for method in {BASE, *config.methods}:
        for step in config.steps_ms:
            name, steps = method, count * (TWIN_FACTOR if method.startswith("twin") else 1)
            if adaptive(method):
                name, steps = f"{method} {step}", round(1e3 * config.horizons[-1] / step)
                works[name] = moving(body, method, step, steps, start, forces)
            elif name not in works:
                works[name] = stepping(body, method, steps)
            cells.append((method, step, name, steps))
    seconds = interleaved_seconds(works, config.repeats, time.process_time)
    return {(m, step): float(np.median(seconds[name])) / n for m, step, name, n in cells}
