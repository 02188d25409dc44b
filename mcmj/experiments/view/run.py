"""A body in MuJoCo's interactive viewer, its loop closed; keys and mouse disturb it."""

import time
from dataclasses import dataclass

import numpy as np

from mcmj.experiments.body_source import readouts_of
from mcmj.learning.lessons import Teaching
from mcmj.learning.teaching import synchronise
from mcmj.metrics import orbits
from mcmj.mjcf.bundled import open_body
from mcmj.pictures.film import deformation_scale
from mcmj.pictures.window.body_viewer import BodyViewer
from mcmj.pictures.window.viewer import FPS, Viewer
from mcmj.simulation.interactive import LiveLoop
from mcmj.simulation.models.reservoir_file import is_reservoir_file
from mcmj.simulation.reservoir import Reservoir
from mcmj.simulation.simulation import Simulation
from mcmj.targets.limit_cycles import TARGETS, target
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array, require_number, require_seed

LONGEST_FRAME = 0.2  # s: a computer that is slower than this shows slow motion
LAST_FRAMES = 15  # of which the distance at the end is the largest
TRIAL = 20.0  # s of a run that shows how far nodes move


@dataclass(frozen=True)
class Config:
    """What to look at.

    Attributes:
        body: a body file, or the name of a body that comes with mcmj. Without a readout in the
            file it is taught the paper's three targets first. Or the file of a trained reservoir
            (Reservoir.to_mjcf) of any model.
        kick_speed: standard deviation of the nodes' speeds after a kick [m/s].
        deformation: displacements are drawn this many times larger; default: a round factor
            that makes them visible.
        seed: of kicks and teaching.
        seconds: close the window after this time [s]; default: when the user does.
        press: keys pressed by themselves, as key@second: 8@2 is a kick after 2 s.
    """

    body: str = "quadratic"
    kick_speed: float = 0.5
    deformation: float | None = None
    seed: int = 0
    seconds: float | None = None
    press: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        require_seed("seed", self.seed)
        require_number("kick_speed", self.kick_speed, 0.0)
        if self.seconds is not None:
            require_number("seconds", self.seconds, 0.0, open_low=True)
        if self.deformation is not None:
            require_number("deformation", self.deformation, 0.0, open_low=True)
        self.presses  # noqa: B018  (checks them)

    @property
    def presses(self) -> list[tuple[float, int]]:
        """Times [s] and key codes, in order of time."""
        found = []
        for word in self.press:
            key, _, second = word.partition("@")
            try:
                found.append((float(second), ord(key)))
            except (TypeError, ValueError) as error:
                raise InvalidArgumentError("press", "key@second, as in 8@2", word) from error
        return sorted(found)


@dataclass(frozen=True)
class Result:
    """What was seen.

    Attributes:
        times, outputs: (K,) [s] since the start and (K, n_outputs), one a frame.
        distances: (K,) of the outputs to the target orbit, over its RMS radius; None if no
            readout is named after a target.
        wall_seconds: how long it took.
    """

    times: Array
    outputs: Array
    distances: Array | None
    wall_seconds: float
    config: Config

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json."""
        shown = float(self.times[-1]) if len(self.times) else 0.0
        away = self.distances
        last = None if away is None else float(away[-LAST_FRAMES:].max(initial=0.0))
        return {
            "frames": len(self.times),
            "frames_per_second": len(self.times) / self.wall_seconds,
            "real_time_factor": shown / self.wall_seconds,
            "largest_orbit_distance": None if away is None else float(away.max(initial=0.0)),
            "last_orbit_distance": last,
        }


def run(config: Config) -> Result:
    """Open the window and run in real time until it is closed, or the time is over.

    Raises:
        NoDisplayError: there is no screen.
        BodyFileError, UnknownNameError: no such body.
    """
    window, loop = _window(config)
    presses, begin = config.presses, loop.time
    times, outputs = [], []
    first = loop.readout
    with window as viewer:
        opened = now = time.perf_counter()
        while viewer.is_open and (config.seconds is None or loop.time - begin < config.seconds):
            time.sleep(max(0.0, now + 1 / FPS - time.perf_counter()))
            before, now = now, time.perf_counter()
            while presses and loop.time - begin >= presses[0][0]:
                viewer.press(presses.pop(0)[1])
            outputs.append(viewer.run_frame(min(now - before, LONGEST_FRAME)))
            times.append(loop.time - begin)
        wall = time.perf_counter() - opened
    seen = np.array(outputs).reshape(-1, loop.reservoir.n_outputs)
    away = orbits.orbit_distances(seen, target(first)) if first in TARGETS and len(seen) else None
    return Result(np.array(times), seen, away, wall, config)


def _window(config: Config) -> tuple[Viewer, LiveLoop]:
    """The window, still closed, and what it shows: a body, or a model from a reservoir's file."""
    kicks = stream(config.seed, "initial_state")
    if is_reservoir_file(config.body):
        reservoir = Reservoir.open(config.body)
        if reservoir.w_out is None:
            raise InvalidArgumentError("body", "a file with a readout", config.body)
        loop = LiveLoop(reservoir, {"readout": reservoir.w_out})
        return Viewer(loop, lambda: loop.kick(config.kick_speed, kicks)), loop
    simulation, readouts = _simulation_and_readouts(config)
    body, first = simulation.body, next(iter(readouts))
    scale = _start(simulation, first, readouts[first])
    body_loop = LiveLoop(simulation, readouts)
    scale = config.deformation or scale
    window = BodyViewer(
        body_loop, lambda: body_loop.kick(config.kick_speed, kicks), body=body, scale=scale
    )
    return window, body_loop


def _simulation_and_readouts(config: Config) -> tuple[Simulation, dict[str, Array]]:
    """As the file says."""
    stored = open_body(config.body)
    readouts = readouts_of(stored, config.seed, engine="twin")
    return Simulation(stored.body, **stored.take()), readouts


def _start(simulation: Simulation, name: str, w_out: Array) -> float:
    """Onto the target if the readout is named after one, else at rest; a scale for the window."""
    if name in TARGETS:
        synchronise(simulation, target(name), Teaching().washout)
    start = simulation.snapshot()
    simulation.set_readout(w_out)
    steps = round(TRIAL / simulation.timestep)
    trial = simulation.rollout(steps, record=("positions",))
    simulation.restore(start)
    return deformation_scale(simulation.body, trial.get("positions"))
