"""A film of a reservoir as it goes on: any MuJoCo model, or a body, beside its outputs."""

from pathlib import Path

import numpy as np

from mcmj.pictures.film import Film, ModelFilm
from mcmj.pictures.rendering import ORBIT_POINTS, Report, write_film
from mcmj.pictures.video_file import OPTIONS
from mcmj.simulation.reservoir import Reservoir
from mcmj.simulation.simulation import Simulation
from mcmj.targets.limit_cycles import Target
from mcmj.targets.named import require_outputs
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import require_duration


def film_of(
    reservoir: Reservoir,
    seconds: float,
    *,
    target: Target | None = None,
    camera: str | None = None,
) -> Film | ModelFilm:
    """Let a reservoir go on, in closed loop if it has a readout, and keep what a film shows.

    Args:
        seconds: [s].
        target: drawn in red.
        camera: of the model, by name; default: one that follows it.

    Raises:
        DivergenceError: it blew up.
        InvalidArgumentError, UnknownNameError: a duration or camera that does not fit, or copies.
    """
    require_duration("seconds", seconds, reservoir.timestep)
    if reservoir.copies is not None:
        raise InvalidArgumentError("reservoir", "one without copies", reservoir.copies)
    if target is not None:
        require_outputs(reservoir, target, "reservoir")
    steps = round(seconds / reservoir.timestep)
    orbit = None if target is None else target.orbit(ORBIT_POINTS)
    if isinstance(reservoir, Simulation):
        body = reservoir.body
        run = reservoir.rollout(steps, record=("outputs", "positions"))
        outputs = run.get("outputs")
        forces = np.where(body.fixed, 0.0, outputs @ body.w_fb.T)
        return Film(body, run.times, run.get("positions"), outputs, forces, orbit)
    run = reservoir.rollout(steps, record=("outputs", "qpos"))
    qpos, outputs = run.get("qpos"), run.get("outputs")
    return ModelFilm(reservoir.model, run.times, qpos, outputs, orbit, camera=camera)


def film(
    reservoir: Reservoir,
    path: str | Path,
    seconds: float = 10.0,
    *,
    target: Target | None = None,
    camera: str | None = None,
) -> Report:
    """Write what a reservoir does next as .mp4 or .gif; see `film_of`.

    Raises:
        InvalidArgumentError: neither .mp4 nor .gif.
        OutputError: the file cannot be written.
        RenderingUnavailableError: there is no OpenGL to draw a model that is no body.
    """
    file = Path(path)
    if file.suffix not in OPTIONS:
        raise InvalidArgumentError("path", f"a name that ends with {' or '.join(OPTIONS)}", path)
    recorded = film_of(reservoir, seconds, target=target, camera=camera)
    return write_film(recorded, {file.suffix: file})
