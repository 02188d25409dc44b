"""Fig. 6: a taught rhythm is disturbed for a while, and comes back."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from mcmj.core.body import Body
from mcmj.core.random_body import BodySettings, draw_body
from mcmj.learning.regression import Fit
from mcmj.learning.teaching import Teaching, teach
from mcmj.metrics import orbits
from mcmj.metrics.success_rates import success_rate
from mcmj.mjcf.bundled import open_body
from mcmj.simulation.run_phases import Phase, RandomForces, Schedule, run_schedule
from mcmj.simulation.simulation import Simulation
from mcmj.targets.limit_cycles import Target
from mcmj.targets.named import named_target, require_outputs
from mcmj.utils.errors import DivergenceError, InvalidArgumentError
from mcmj.utils.progress import OnSteps
from mcmj.utils.validation import (
    Array,
    require_count,
    require_duration,
    require_number,
    require_seed,
    require_timestep,
)

# what a search over many bodies leaves out, see mcmj.search.experiment
SEARCH_DEFAULTS = {"noise_curve": ()}

# chosen by the recoveries of bodies 0 to 19 and 100 to 239, on the twin
DRAWN = BodySettings(nodes=20, feedback_fraction=0.5, d1=(0.1, 2.0))
TAUGHT = Teaching(
    noise=0.4,
    ridge_per_row=1e-6,  # as against a length noise of 1e-3 m
    rest_runs=2,  # they widen the basin: a frozen output leads far from the orbit
    rest_duration=30.0,
    rest_weight=1e-2,
)


@dataclass(frozen=True)
class Config:
    """What to run.

    Attributes:
        task: van_der_pol, .., a .csv file or package.module:function.
        body: a body file, or the name of a body that comes with mcmj; default: a random body.
            It is always taught: readouts in the file are not used. Integrator and spring law
            are the file's, unless the engine is the twin.
        seed: of the random body, the noises and the forces.
        seeds: number of bodies of consecutive seeds for the table of successes.
        before, window, after: lengths of the phases: undisturbed, disturbed, free again [s].
        force: random forces are uniform in [-force, force] on every node [N].
        sensor_noise: standard deviation of the noise on the lengths [m].
        noise_curve: amplitudes of the curve of noise tolerance [m].
        tolerance: of the target orbit, over its RMS radius, for recovery and for success.
        error_window: the orbit error is that of this last part [s].
        timestep: control and physics step [s].
        engine: mujoco, or twin: faster, the same to rounding.
        settings: what a random body is drawn from.
        teaching: how the readout is taught; with a ridge it stands 100 x more sensor noise.
    """

    task: str = "quadratic"
    body: str | None = None
    seed: int = 0
    seeds: int = 1
    before: float = 10.0
    window: float = 10.0
    after: float = 40.0
    force: float = 10.0
    sensor_noise: float = 0.1
    noise_curve: tuple[float, ...] = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
    tolerance: float = 0.05
    error_window: float = 20.0
    timestep: float = 1e-3
    engine: str = "mujoco"
    settings: BodySettings = DRAWN
    teaching: Teaching = field(default_factory=lambda: TAUGHT)

    def __post_init__(self) -> None:
        period = named_target(self.task).period
        require_seed("seed", self.seed)
        require_count("seeds", self.seeds, 1)
        require_timestep("timestep", self.timestep)
        for name in ("before", "window", "after"):
            require_duration(name, getattr(self, name), self.timestep)
        for name in ("force", "sensor_noise", "tolerance"):
            require_number(name, getattr(self, name), 0.0, open_low=True)
        require_number("error_window", self.error_window, 0.0, self.after, open_low=True)
        for std in self.noise_curve:
            require_number("noise_curve", std, 0.0, open_low=True)
        if self.body is not None and (self.settings != DRAWN or self.seeds > 1):
            raise InvalidArgumentError("body", "no settings or seeds beside it", self.body)
        require_number("after", self.after, 2 * period)
        require_number("error_window", self.error_window, orbits.PERIODS_NEEDED * period)

    @property
    def perturbations(self) -> dict[str, Phase]:
        """The disturbed phases of Fig. 6, by name."""
        disturbed = Phase(self.window)
        return {
            **{
                f"frozen_x{output + 1}": replace(disturbed, freeze=(output,))
                for output in range(named_target(self.task).n_outputs)
            },
            "random_forces": replace(disturbed, forces=RandomForces(self.force)),
            "length_noise": replace(disturbed, length_noise=self.sensor_noise),
        }


@dataclass(frozen=True)
class Recovery:
    """One perturbation of one body.

    Attributes:
        times: (T,) [s], 0 at the start of the undisturbed phase; empty if it blew up.
        outputs: (T, n_outputs) as fed back: a frozen output is constant, a noisy one noisy.
        clean: (T, n_outputs) of the lengths without noise.
        boundaries: rows at which the phases begin, and T.
        orbit_error: of the last part, infinite if it blew up.
        recovery_time: from the end of the disturbance until the outputs stay within the
            tolerance of the orbit [s], infinite if they do not.
    """

    times: Array
    outputs: Array
    clean: Array
    boundaries: tuple[int, ...]
    orbit_error: float
    recovery_time: float


LOST = Recovery(np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2)), (0,), np.inf, np.inf)


@dataclass(frozen=True)
class BodyResult:
    """One body under all perturbations; `noise_errors` (amplitudes,) is its tolerance curve."""

    body: Body
    source: dict[str, object]
    fit: Fit | None
    unperturbed_error: float
    recoveries: dict[str, Recovery]
    noise_errors: Array


@dataclass(frozen=True)
class Result:
    """All bodies; the first is drawn."""

    config: Config
    target: Target
    bodies: list[BodyResult]

    @property
    def body(self) -> Body:
        """The first body."""
        return self.bodies[0].body

    @property
    def readouts(self) -> dict[str, Array]:
        """The first body's readout by task; empty if it blew up under the teacher."""
        fit = self.bodies[0].fit
        return {} if fit is None else {self.target.name: fit.w_out}

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json: the first body's numbers, and counts over all seeds."""
        first, config = self.bodies[0], self.config
        table: dict[str, object] = {
            name: {"orbit_error": r.orbit_error, "recovery_time": r.recovery_time}
            for name, r in first.recoveries.items()
        }
        table["unperturbed"] = {"orbit_error": first.unperturbed_error}
        table["noise_curve"] = {
            "amplitudes": config.noise_curve,
            "orbit_errors": first.noise_errors,
            "recovered": [self._count([b.noise_errors[k] for b in self.bodies])
                          for k in range(len(config.noise_curve))],
        }  # fmt: skip
        if config.seeds > 1:
            table["seeds"] = {name: self.over_seeds(name) for name in first.recoveries}
            errors = [body.unperturbed_error for body in self.bodies]
            table["seeds"]["unperturbed"] = self._count(errors)  # type: ignore[index]
        return table

    def over_seeds(self, name: str) -> dict[str, object]:
        """How many bodies recover from a perturbation, and how fast: the median of all."""
        of_all = [body.recoveries[name] for body in self.bodies]
        errors, times = [r.orbit_error for r in of_all], [r.recovery_time for r in of_all]
        return {
            **self._count(errors),
            "median_orbit_error": float(np.median(errors)),
            "median_recovery_time": float(np.median(times)),
            "orbit_errors": errors,
            "recovery_times": times,
        }

    def _count(self, errors: Sequence[float]) -> dict[str, object]:
        return success_rate([error < self.config.tolerance for error in errors])


def total_steps(config: Config) -> int:
    """Control steps of a whole run, for a progress bar."""
    runs = 1 + len(config.perturbations) + len(config.noise_curve)
    run_length = config.before + config.window + config.after
    seconds = config.teaching.total + runs * run_length
    return config.seeds * round(seconds / config.timestep)


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Teach every body, disturb it in every way, and measure how it comes back.

    Raises:
        InvalidArgumentError: a body without as many outputs as the task has.
    """
    wanted = named_target(config.task)
    bodies = [
        _of_body(config, config.seed + index, wanted, on_steps) for index in range(config.seeds)
    ]
    return Result(config, wanted, bodies)


def get_body(config: Config, seed: int) -> tuple[Body, dict[str, object], dict[str, Any]]:
    """The body of a seed, or the config's; where it comes from; arguments of its Simulation."""
    given: dict[str, Any] = {"timestep": config.timestep}
    if config.body is None:
        source = {"seed": seed, "settings": asdict(config.settings)}
        return draw_body(seed, config.settings), source, given
    stored = open_body(config.body)
    names = ("integrator", "springs") if config.engine == "mujoco" else ()
    return stored.body, stored.provenance, stored.take(*names, **given)


def _of_body(config: Config, seed: int, wanted: Target, on_steps: OnSteps) -> BodyResult:
    body, source, settings = get_body(config, seed)
    require_outputs(body, wanted)
    simulation = Simulation(body, engine=config.engine, **settings)
    curve = [Phase(config.window, length_noise=std) for std in config.noise_curve]
    try:
        fit = teach(simulation, wanted, config.teaching, seed, on_steps=on_steps)
    except DivergenceError:
        lost = dict.fromkeys(config.perturbations, LOST)
        return BodyResult(body, source, None, np.inf, lost, np.full(len(curve), np.inf))
    start = simulation.snapshot()

    def after(phase: Phase) -> Recovery:
        simulation.restore(start)
        return disturb(config, simulation, phase, seed, wanted, on_steps)

    return BodyResult(
        body=body,
        source=source,
        fit=fit,
        unperturbed_error=after(Phase(config.window)).orbit_error,
        recoveries={name: after(phase) for name, phase in config.perturbations.items()},
        noise_errors=np.array([after(phase).orbit_error for phase in curve]),
    )


def disturb(
    config: Config,
    simulation: Simulation,
    phase: Phase,
    seed: int,
    wanted: Target,
    on_steps: OnSteps = lambda steps: None,
) -> Recovery:
    """Run free, disturbed and free again; a body that blows up has not recovered."""
    schedule = Schedule([Phase(config.before), phase, Phase(config.after)])
    try:
        run = run_schedule(simulation, schedule, seed, on_steps=on_steps)
    except DivergenceError:
        return LOST
    free = run.feedback[run.phase(-1)]
    last = free[-round(config.error_window / config.timestep) :]
    return Recovery(
        times=run.trajectory.times - run.trajectory.times[0],
        outputs=run.feedback,
        clean=run.trajectory.get("outputs"),
        boundaries=run.boundaries,
        orbit_error=orbits.orbit_error(last, wanted),
        recovery_time=orbits.recovery_time(
            free, config.timestep, wanted, tolerance=config.tolerance
        ),
    )
