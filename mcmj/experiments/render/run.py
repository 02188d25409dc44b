"""A film of a body at work: run it, disturbed or not, or read a trajectory file."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from mcmj.core.body import Body
from mcmj.core.trajectory import Trajectory, join
from mcmj.learning.lessons import Teaching
from mcmj.learning.teaching import synchronise, teach
from mcmj.mjcf.bundled import StoredBody, open_body
from mcmj.pictures.film import Film, Window
from mcmj.pictures.rendering import ORBIT_POINTS, Style
from mcmj.simulation.phases import Phase, Schedule
from mcmj.simulation.run_phases import ScheduleRun, run_schedule
from mcmj.simulation.simulation import Simulation
from mcmj.simulation.trajectory_files.npz import load_trajectory
from mcmj.targets.limit_cycles import Target
from mcmj.targets.named import NAMES, named_target, require_outputs
from mcmj.utils.errors import TrajectoryFileError, UnknownNameError
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array, require_count, require_duration, require_number

FORMATS = ("mp4", "gif", "png")


@dataclass(frozen=True)
class Config:
    """What to show.

    Attributes:
        body: a body file, or the name of a body that comes with mcmj; it is stepped as the
            file says.
        trajectory: a trajectory file (.npz or .zarr) with a body and positions, shown instead
            of a run.
        readout: name of a readout in the body file; default: that of the task, else its active
            one; a body without any is taught the task.
        task: van_der_pol, .., a gait, a .csv file or package.module:function: drawn in red, on
            which the run starts, and what a body without readout is taught; default: the
            readout's name if it is a target, else none (such a run starts at rest), or
            van_der_pol for a body without readout.
        seed: of noise and random forces.
        duration: of the run, if nothing disturbs it [s].
        freeze: outputs (1, 2, ..) that are held at their value while the body is disturbed.
        forces: constant random forces on all nodes up to this [N] while it is disturbed.
        length_noise: white noise on all lengths [m], standard deviation, while it is disturbed.
        kick: random speed given to all nodes as the disturbance begins [m/s].
        before, during, after: the disturbance, and the free runs around it [s].
        from_rest: start at total rest instead of on the target.
        deformation: displacements are drawn this many times larger; default: a round factor
            that makes them visible.
        formats: any of mp4, gif, png.
        stills: number of PNG pictures.
        style: frames a second, speed, renderer.
    """

    body: str = "quadratic"
    trajectory: Path | None = None
    readout: str | None = None
    task: str | None = None
    seed: int = 0
    duration: float = 15.0
    freeze: tuple[int, ...] = ()
    forces: float = 0.0
    length_noise: float = 0.0
    kick: float = 0.0
    before: float = 5.0
    during: float = 5.0
    after: float = 15.0
    from_rest: bool = False
    deformation: float | None = None
    formats: tuple[str, ...] = FORMATS
    stills: int = 3
    style: Style = field(default_factory=Style)

    def __post_init__(self) -> None:
        for name in ("duration", "before", "during", "after"):
            require_duration(name, getattr(self, name))
        for name in ("forces", "length_noise", "kick"):
            require_number(name, getattr(self, name), 0.0)
        for output in self.freeze:
            require_count("freeze", output, 1)
        require_count("stills", self.stills, 1)
        for kind in self.formats:
            if kind not in FORMATS:
                raise UnknownNameError("format", kind, FORMATS)
        if self.task is not None:
            named_target(self.task)

    @property
    def disturbance(self) -> str:
        """What disturbs the body, in words; empty if nothing does."""
        words = [f"output x{output} frozen" for output in self.freeze]
        words += [f"random forces up to {self.forces:g} N"] * (self.forces > 0)
        words += [f"length noise {self.length_noise:g} m"] * (self.length_noise > 0)
        words += [f"kicked at {self.kick:g} m/s"] * (self.kick > 0)
        return ", ".join(words)


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Film:
    """The film that a config asks for.

    Raises:
        BodyFileError, TrajectoryFileError, UnknownNameError: a file or name that does not fit.
        DivergenceError: the body blew up.
    """
    if config.trajectory is not None:
        return _film_of_file(config, config.trajectory)
    stored = open_body(config.body)
    w_out, wanted = _find(config, stored)
    simulation = Simulation(stored.body, **stored.take(*stored.settings))
    if w_out is None and wanted is not None:
        teach(simulation, wanted, Teaching(), config.seed, on_steps=on_steps)
        w_out = simulation.w_out
    elif wanted is not None and not config.from_rest:
        synchronise(simulation, wanted, Teaching().washout)
    simulation.set_readout(w_out)
    if config.from_rest:
        simulation.reset()
    return _film_of_run(config, simulation, wanted, on_steps)


def _film_of_file(config: Config, path: Path) -> Film:
    stored = load_trajectory(path)
    trajectory, body = stored.trajectory, stored.body
    if body is None or trajectory.positions is None or trajectory.positions.ndim != 3:
        raise TrajectoryFileError(
            f"{path}: a film needs the body and the positions of one run: save_trajectory(path, "
            "simulation.rollout(.., record=('outputs', 'positions')), body=body)"
        )
    outputs = trajectory.outputs
    if outputs is None:
        outputs = np.zeros((len(trajectory), body.n_outputs))
    wanted = None if config.task is None else named_target(config.task)
    return _film(config, body, trajectory, outputs, np.zeros(body.n_nodes), wanted)


def _find(config: Config, stored: StoredBody) -> tuple[Array | None, Target | None]:
    """The body's readout if it has one, and the target: one of the two is there."""
    body, named = stored.body, stored.readouts
    if config.readout is not None and config.readout not in named:
        raise UnknownNameError("readout", config.readout, named)
    wanted = None if config.task is None else named_target(config.task)
    name = config.readout or (wanted.name if wanted else next(iter(named), ""))
    w_out = named[name] if named and name in named else None
    if w_out is None and not named:
        w_out = stored.w_out
    if wanted is None and (name in NAMES or w_out is None):
        wanted = named_target(name if name in NAMES else "van_der_pol")
    if wanted is not None:
        require_outputs(body, wanted)
    return w_out, wanted


def _film_of_run(
    config: Config, simulation: Simulation, wanted: Target | None, on_steps: OnSteps
) -> Film:
    """Before, during and after the disturbance; or one undisturbed stretch."""
    body, draw = simulation.body, stream(config.seed, "forces")
    pushes = draw.uniform(-config.forces, config.forces, body.n_nodes)
    kick = config.kick * draw.standard_normal((body.n_nodes, 2))

    def advance(phases: list[Phase]) -> ScheduleRun:
        record = ("outputs", "positions")
        return run_schedule(
            simulation, Schedule(phases), config.seed, record=record, on_steps=on_steps
        )

    if not config.disturbance:
        run = advance([Phase(config.duration)])
        return _film(config, body, run.trajectory, run.feedback, np.zeros_like(pushes), wanted)
    before = advance([Phase(config.before)])
    start = simulation.time
    simulation.set_state(velocities=simulation.state.velocities + kick)
    disturbed = Phase(
        config.during, freeze=tuple(output - 1 for output in config.freeze), forces=pushes,
        length_noise=config.length_noise,
    )  # fmt: skip
    rest = advance([disturbed, Phase(config.after)])
    trajectory = join([before.trajectory, rest.trajectory])
    pushed = np.zeros((len(trajectory), body.n_nodes))
    pushed[len(before.feedback) :][rest.phase(0)] = pushes
    feedback = np.concatenate([before.feedback, rest.feedback])
    window = Window(start, start + config.during, config.disturbance)
    film = _film(config, body, trajectory, feedback, pushed, wanted)
    return replace(film, windows=(window,))


def _film(
    config: Config, body: Body, trajectory: Trajectory, outputs: Array, pushes: Array,
    wanted: Target | None,
) -> Film:  # fmt: skip
    """Arrows show what feeds back and what pushes from outside, (N,) or (T, N) [N]."""
    forces = outputs @ body.w_fb.T + pushes
    return Film(
        body=body,
        times=trajectory.times,
        positions=trajectory.get("positions"),
        outputs=outputs,
        forces=np.where(body.fixed, 0.0, forces),
        orbit=None if wanted is None else wanted.orbit(ORBIT_POINTS),
        deformation=config.deformation,
    )
