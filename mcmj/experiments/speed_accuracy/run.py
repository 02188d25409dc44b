"""Speed against error: every integrator on several bodies, against DOP853.

Each body is kicked and pulled by constant forces, loop open. The error is the relative
position error |p - p*| / |p* - p(0)| at a horizon, p* by DOP853; the cost is that of a simulated
second, as microseconds and as a ratio to MuJoCo's Euler at 1 ms, measured in turns.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from mcmj.core.body import Body
from mcmj.core.random_body import random_body
from mcmj.core.trajectory import State
from mcmj.experiments.speed_accuracy.attractor import attractor_errors
from mcmj.experiments.speed_accuracy.methods import METHODS, final_state, stepping
from mcmj.metrics.convergence import Order, observed_order
from mcmj.mjcf.bundled import body_path
from mcmj.mjcf.read import from_mjcf
from mcmj.reference.integration import integrate
from mcmj.utils.errors import DivergenceError, InvalidArgumentError, UnknownNameError
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream
from mcmj.utils.timing import interleaved_seconds
from mcmj.utils.validation import (
    SHORTEST_STEP,
    Array,
    require_count,
    require_duration,
    require_number,
    require_seed,
)

TOOLBOX = {"d1": (0.1, 2.0)}
BODIES: dict[str, Callable[[int], Body]] = {
    "toolbox_n10": lambda seed: random_body(seed, 10, **TOOLBOX),
    "toolbox_n30": lambda seed: random_body(seed, 30, **TOOLBOX),
    "toolbox_n100": lambda seed: random_body(seed, 100, **TOOLBOX),
    "toolbox_n300": lambda seed: random_body(seed, 300, **TOOLBOX),
    "small_area": lambda seed: random_body(seed, 30, width=1.0, height=1.0, **TOOLBOX),
    "stiff_springs": lambda seed: random_body(
        seed, 30, k1=(1e4, 1e5), k3=(1e6, 1e7), d1=(0.1, 2.0)
    ),
    "stiff_dampers": lambda seed: random_body(seed, 30, d1=(0.1, 2.0), d3=(1e3, 1e4)),
}
BASE = "mujoco_Euler"
TIGHTER = 5e-13  # relative tolerance: with less, stiff springs drown in rounding


@dataclass(frozen=True)
class Config:
    """What to measure.

    Attributes:
        bodies: names of BODIES.
        methods: names of METHODS.
        steps_ms: integration steps [ms]; the horizons must be multiples of them.
        horizons: times at which the error is taken [s]; the last one is the table's.
        speed: initial speeds are uniform in +-speed [m/s].
        force: constant horizontal forces are uniform in +-force [N].
        seed: of bodies, forces and speeds.
        repeats: rounds of the cost measurement, of which the median counts.
        attractor: also run the general body's rhythms under other integrators than taught under.
    """

    bodies: tuple[str, ...] = tuple(BODIES)
    methods: tuple[str, ...] = METHODS
    steps_ms: tuple[float, ...] = (0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
    horizons: tuple[float, ...] = (0.2, 2.0)
    speed: float = 0.5
    force: float = 1.0
    seed: int = 1
    repeats: int = 7
    attractor: bool = True

    def __post_init__(self) -> None:
        for kind, names, valid in (
            ("body", self.bodies, tuple(BODIES)),
            ("method", self.methods, METHODS),
        ):
            for name in names:
                if name not in valid:
                    raise UnknownNameError(kind, name, valid)
        require_seed("seed", self.seed)
        require_number("speed", self.speed, 0.0)
        require_number("force", self.force, 0.0)
        require_count("repeats", self.repeats, 1)
        for step in self.steps_ms:
            require_number("steps_ms", step, 1e3 * SHORTEST_STEP)
            for horizon in self.horizons:
                require_duration("horizons", horizon, 1e-3 * step)
                if abs(horizon * 1e3 / step - round(horizon * 1e3 / step)) > 1e-9:
                    raise InvalidArgumentError(
                        "steps_ms", f"divisors of the horizon {horizon:g} s", f"{step:g} ms"
                    )


@dataclass(frozen=True)
class Cell:
    """One body, method and step: errors (inf where it blew up) at the horizons, and the cost."""

    position_errors: tuple[float, ...]
    length_error: float
    us_per_second: float
    cost_ratio: float

    @property
    def error(self) -> float:
        """Relative position error at the last horizon."""
        return self.position_errors[-1]

    @property
    def stable(self) -> bool:
        """It did not blow up, and is not all wrong."""
        return self.error < 1.0


@dataclass(frozen=True)
class Result:
    """What was measured.

    Attributes:
        cells: [body][method][step_ms].
        orders: observed order by method; None where too few steps were usable.
        self_consistency: by body, how far DOP853 at rtol 1e-12 is from a run at 5e-13.
        attractor: [task]["A_to_B"] orbit errors of readouts taught under A and run under B.
    """

    config: Config
    cells: dict[str, dict[str, dict[float, Cell]]]
    orders: dict[str, Order | None]
    self_consistency: dict[str, float]
    attractor: dict[str, dict[str, float]]

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json."""
        table: dict[str, object] = {
            body: {
                method: {
                    f"{step:g}": {
                        "error": cell.error,
                        "errors_at_horizons": cell.position_errors,
                        "length_error": cell.length_error,
                        "us_per_simulated_second": cell.us_per_second,
                        "cost_ratio": cell.cost_ratio,
                        "stable": cell.stable,
                    }
                    for step, cell in steps.items()
                }
                for method, steps in methods.items()
            }
            for body, methods in self.cells.items()
        }
        table["order"] = {
            name: order.slope if order else None for name, order in self.orders.items()
        }
        table["order_fitted_on_ms"] = {
            name: order.steps_ms if order else None for name, order in self.orders.items()
        }
        table["reference_self_consistency"] = max(self.self_consistency.values())
        table["attractor_orbit_error"] = self.attractor
        table["recommendation"] = {body: recommend(cells) for body, cells in self.cells.items()}
        return table


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Measure every body."""
    cells, consistency = {}, {}
    for name in config.bodies:
        cells[name], consistency[name] = _run_body(config, BODIES[name](config.seed))
        on_steps(1)
    orders = {m: observed_order(cells, m) for m in config.methods}
    attractor = {}
    if config.attractor:
        attractor = attractor_errors(from_mjcf(body_path("general"))[0], seed=0)
    return Result(config, cells, orders, consistency, attractor)


def recommend(
    methods: dict[str, dict[float, Cell]],
    wanted: tuple[float, ...] = (1e-2, 1e-3, 1e-4, 1e-6, 1e-8),
) -> dict[str, str | None]:
    """The cheapest MuJoCo method and step for each wanted error."""
    choice: dict[str, str | None] = {}
    for goal in wanted:
        good = [
            (cell.cost_ratio, f"{method.removeprefix('mujoco_')} at {step:g} ms")
            for method, steps in methods.items()
            for step, cell in steps.items()
            if method.startswith("mujoco_") and cell.error <= goal
        ]
        choice[f"{goal:g}"] = min(good)[1] if good else None
    return choice


def _run_body(config: Config, body: Body) -> tuple[dict[str, dict[float, Cell]], float]:
    start = _kicked(body, config)
    forces = stream(config.seed, "forces").uniform(-config.force, config.force, body.n_nodes)
    goals = [_reference(body, start, forces, t, 1e-12) for t in config.horizons]
    tighter = _reference(body, start, forces, config.horizons[-1], TIGHTER)
    costs = _costs_per_step(config, body)
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
                us_per_second=costs[method] * per_second * 1e6,
                cost_ratio=costs[method] / costs[BASE] / step_ms,
            )
    return cells, _relative(goals[-1].positions, tighter.positions, body.positions)


def _kicked(body: Body, config: Config) -> State:
    rng = stream(config.seed, "initial_state")
    speeds = rng.uniform(-config.speed, config.speed, (body.n_nodes, 2))
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


def _costs_per_step(config: Config, body: Body) -> dict[str, float]:
    """Median seconds of a step at 1 ms from rest, open loop, nothing recorded, in turns."""
    steps = max(20, 30_000 // body.n_springs)
    works = {method: stepping(body, method, steps) for method in {BASE, *config.methods}}
    seconds = interleaved_seconds(works, config.repeats)
    return {method: float(np.median(s)) / steps for method, s in seconds.items()}
