"""A film of a body at work: run it, disturbed or not, or read a trajectory file."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from mcmj.core.body import Body
from mcmj.core.trajectory import Trajectory, join
from mcmj.experiments.render.config import Config
from mcmj.learning.lessons import Teaching
from mcmj.learning.teaching import synchronise, teach
from mcmj.mjcf.bundled import StoredBody, open_body
from mcmj.pictures.film import Film, Window
from mcmj.pictures.rendering import ORBIT_POINTS
from mcmj.simulation.phases import Phase, Schedule
from mcmj.simulation.run_phases import ScheduleRun, run_schedule
from mcmj.simulation.simulation import Simulation
from mcmj.simulation.trajectory_files.npz import load_trajectory
from mcmj.targets.limit_cycles import Target
from mcmj.targets.named import NAMES, named_target, require_outputs
from mcmj.utils.errors import TrajectoryFileError, UnknownNameError
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array


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
    kick = config.kick * draw.standard_normal(body.positions.shape)

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
