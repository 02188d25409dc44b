"""From a body file to a page: readouts, where they start, trial runs, a run to check with."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mcmj.core.callbacks.spring_laws import NATIVE
from mcmj.core.integrators import integrator_named
from mcmj.core.options import Options
from mcmj.core.readout import Readout
from mcmj.core.trajectory import State, Trajectory
from mcmj.experiments.body_source import readouts_of
from mcmj.experiments.web.config import Config
from mcmj.learning.lessons import Teaching
from mcmj.learning.teaching import synchronise
from mcmj.mjcf.bundled import StoredBody, open_body
from mcmj.pictures.web_page.package import open_package
from mcmj.pictures.web_page.page import page
from mcmj.pictures.web_page.scene import Check, Scene, ShownReadout
from mcmj.simulation.models.reservoir_file import is_reservoir_file
from mcmj.simulation.simulation import Simulation
from mcmj.targets.input_systems import QUADRATIC
from mcmj.targets.limit_cycles import Target
from mcmj.targets.named import NAMES, named_target
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.validation import Array

TRIAL, EVERY = 20.0, 10  # s of a run that shows how far nodes move; steps between its rows
STOPS = 15  # of the slider of an input
UNTAUGHT = (-1.0, 1.0)  # its ends, if the file does not say with which inputs it was taught
ORBIT_POINTS = 200  # of a target, as drawn
CHECKED, ROWS_APART, PUSHED, PUSH = 2000, 50, 500, 1.0  # steps, steps, steps, N


@dataclass(frozen=True)
class Result:
    """A page, and what it shows."""

    config: Config
    scene: Scene
    html: str

    @property
    def metrics(self) -> dict[str, object]:
        """Of the page; the outputs are those at the end of the run that it checks itself with."""
        scene = self.scene
        return {
            "page_bytes": len(self.html.encode()),
            "integrator": scene.options.integrator,
            "readouts": [readout.name for readout in scene.readouts],
            "deformation": scene.scale,
            "largest_strain": scene.largest_strain,
            "check_steps": scene.check.steps,
            "check_outputs": scene.check.outputs[-1],
        }


def run(config: Config) -> Result:
    """The page that a config asks for.

    Raises:
        PackageError: MuJoCo's WebAssembly package is not there and cannot be fetched.
        UnknownNameError, BodyFileError: no such body or readout.
        InvalidArgumentError: a body that needs mcmj's callbacks, which no browser runs.
        DivergenceError: the body blew up.
    """
    package = open_package(config.package)
    scene = scene_of(config)
    return Result(config, scene, page(scene, package))


def scene_of(config: Config) -> Scene:
    """What the page shows; the errors are those of `run`."""
    if is_reservoir_file(config.body):
        raise InvalidArgumentError(
            "body", "a body of mcmj's, no reservoir's file (`mcmj view` shows it)", config.body
        )
    stored = open_body(config.body)
    options, note = _options(stored)
    readouts = _chosen_first(readouts_of(stored, config.seed, **vars(options)), config.readout)
    stops = _stops(stored)
    shown, positions = [], []
    for name, rows in readouts.items():
        start = _start(stored, options, name, rows, stops)
        trials = _trials(stored, options, start, stops)
        outputs = np.concatenate([trial.get("outputs")[::EVERY] for trial in trials])
        shown.append(replace(start, outputs=outputs))
        positions += [trial.get("positions")[::EVERY] for trial in trials]
    return Scene(
        title=f"A soft body computes: {Path(config.body).stem}",
        body=stored.body,
        options=options,
        readouts=shown,
        stops=stops,
        positions=np.concatenate(positions),
        check=_check(stored, options, shown[0], stops),
        kick_speed=config.kick_speed,
        deformation=config.deformation,
        note=note,
    )


def _options(stored: StoredBody) -> tuple[Options, str]:
    """How the page steps, as the file says, but by an integrator of MuJoCo's own; and a note."""
    written = Options(**stored.take(*stored.settings))
    if written.springs != NATIVE:
        raise InvalidArgumentError(
            "body", "MuJoCo's own springs, for a browser runs no callbacks", written.springs
        )
    integrator = integrator_named(written.integrator)
    if not integrator.by_callback:
        return written, ""
    options = Options(**stored.take(*stored.settings, integrator=integrator.mujoco_name))
    return options, f"The file asks for {integrator.name}, which needs mcmj's callbacks."


def _chosen_first(readouts: dict[str, Array], first: str | None) -> dict[str, Array]:
    if first is None:
        return readouts
    if first not in readouts:
        raise UnknownNameError("readout", first, readouts)
    return {first: readouts[first], **readouts}


def _stops(stored: StoredBody) -> list[Array]:
    """The values of each input's slider, between the ends that the body was taught with."""
    low, high = _taught(stored) or UNTAUGHT
    spaced = np.geomspace if low > 0 else np.linspace
    values = np.array([float(f"{value:.3g}") for value in spaced(low, high, STOPS)])
    return [values] * stored.body.n_inputs


def _taught(stored: StoredBody) -> tuple[float, float] | None:
    """The smallest and the largest input, in a file of `input_driven`."""
    taught = stored.provenance.get("taught_inputs", ())
    return (min(taught), max(taught)) if len(taught) > 1 and stored.body.n_inputs == 1 else None


def _targets(stored: StoredBody, name: str, stops: Sequence[Array]) -> list[Target]:
    """Of a readout: none, one, or one for every stop of the input."""
    if name in NAMES:
        found = [named_target(name)]
    elif _taught(stored):
        found = [QUADRATIC.cycle(float(value)) for value in stops[0]]
    else:
        found = []
    return [one for one in found if one.n_outputs == stored.body.n_outputs]


def _start(
    stored: StoredBody, options: Options, name: str, rows: Array, stops: Sequence[Array]
) -> ShownReadout:
    """A readout, its target, and its start: on the target, or at rest without one. No trial yet."""
    body, targets = stored.body, _targets(stored, name, stops)
    simulation = Simulation(body, **vars(options))
    if targets:
        middle = targets[STOPS // 2 if len(targets) > 1 else 0]
        synchronise(simulation, middle, Teaching().washout, _held(stops, STOPS // 2))
    state: State = simulation.state
    return ShownReadout(
        name=name,
        readout=Readout.of(rows, body.n_springs, body.n_outputs, name),
        positions=state.positions,
        velocities=state.velocities,
        outputs=np.empty((0, body.n_outputs)),
        orbits=[target.orbit(ORBIT_POINTS) for target in targets],
    )


def _held(stops: Sequence[Array], index: int) -> Array:
    """Values (n_inputs,) of the inputs, all sliders at that stop."""
    return np.array([values[index] for values in stops])


def _closed_loop(
    stored: StoredBody, options: Options, shown: ShownReadout, inputs: Array, forces: Array,
) -> Trajectory:  # fmt: skip
    """From the start of a readout, with constant inputs (n_inputs,) and forces (T, N)."""
    simulation = Simulation(stored.body, w_out=shown.readout, **vars(options))
    simulation.set_state(shown.positions, shown.velocities)
    held = np.tile(inputs, (len(forces), 1)) if inputs.size else None
    record = ("outputs", "positions")
    return simulation.rollout(len(forces), inputs=held, forces=forces, record=record)


def _trials(
    stored: StoredBody, options: Options, shown: ShownReadout, stops: Sequence[Array]
) -> list[Trajectory]:
    """Runs at the ends and in the middle of the inputs; one without inputs."""
    forces = np.zeros((round(TRIAL / options.timestep), stored.body.n_nodes))
    ends = (0, STOPS // 2, STOPS - 1) if stops else (0,)
    return [_closed_loop(stored, options, shown, _held(stops, end), forces) for end in ends]


def _check(
    stored: StoredBody, options: Options, shown: ShownReadout, stops: Sequence[Array]
) -> Check:
    """A run that every part of the page's loop has a part in: inputs, readout, a push."""
    body = stored.body
    forces = np.zeros((CHECKED, body.n_nodes))
    forces[:PUSHED, body.free[-1]] = PUSH
    run = _closed_loop(stored, options, shown, _held(stops, STOPS // 2), forces)
    return Check(
        outputs=run.get("outputs")[::ROWS_APART],
        steps=CHECKED,
        every=ROWS_APART,
        index=len(body.free) - 1,
        force=PUSH * body.direction,
        pushed=PUSHED,
    )
