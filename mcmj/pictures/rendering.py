"""Videos and pictures of a body at work: springs coloured by strain, deformation magnified.

Pictures come from MuJoCo's off-screen renderer, or from matplotlib where there is no OpenGL,
so that they never depend on a driver.
"""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median

import numpy as np
from PIL import Image

from mcmj.core.body import Body
from mcmj.pictures.film import Film, ModelFilm
from mcmj.pictures.film_figure import FilmFigure
from mcmj.pictures.flat_view import FlatView
from mcmj.pictures.model_view import ModelView
from mcmj.pictures.opengl import RenderingUnavailableError
from mcmj.pictures.opengl_view import GLView
from mcmj.pictures.video_file import Picture, Video, new_video
from mcmj.targets.limit_cycles import Target
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.files import whole_file
from mcmj.utils.progress import OnSteps
from mcmj.utils.validation import Array, require_count, require_number

WIDTH, HEIGHT, PANEL_WIDTH = 640, 480, 384  # pixels of the body's picture; of the panel beside it
RENDERERS = ("auto", "mujoco", "matplotlib")
GIF_SHARE = 2  # a GIF is so many times smaller and has so many times fewer frames
ORBIT_POINTS = 1000  # of a target, as drawn


@dataclass
class Report:
    """How the pictures were made.

    Attributes:
        backend: egl, osmesa, window system, or matplotlib.
        why_flat: why there is no OpenGL, if matplotlib had to do.
        body_ms, frame_ms: of every picture of the body alone, and with axes and text [ms].
    """

    backend: str = ""
    why_flat: str = ""
    body_ms: list[float] = field(default_factory=list)
    frame_ms: list[float] = field(default_factory=list)

    @property
    def metrics(self) -> dict[str, object]:
        """Medians over the frames, as in metrics.json."""
        return {
            "renderer": self.backend,
            "frames": len(self.frame_ms),
            "body_frame_ms": median(self.body_ms) if self.body_ms else None,
            "whole_frame_ms": median(self.frame_ms) if self.frame_ms else None,
        }


@dataclass(frozen=True)
class Style:
    """How a film is shown.

    Attributes:
        fps: frames a second.
        speed: 1: real time; 2: twice as fast; 0.5: slowed down.
        renderer: auto (MuJoCo's, or matplotlib without OpenGL), mujoco or matplotlib.
        samples: of MuJoCo's multisampling; 0: none, the fastest.
    """

    fps: float = 25.0
    speed: float = 1.0
    renderer: str = "auto"
    samples: int = 0

    def __post_init__(self) -> None:
        require_number("fps", self.fps, 0.0, open_low=True)
        require_number("speed", self.speed, 0.0, open_low=True)
        require_count("samples", self.samples, 0)
        if self.renderer not in RENDERERS:
            raise UnknownNameError("renderer", self.renderer, RENDERERS)

    @property
    def pace(self) -> str:
        """The speed in words."""
        if self.speed == 1.0:
            return "real time"
        if self.speed > 1.0:
            return f"{self.speed:.2g} x faster"
        return f"slowed {1 / self.speed:.2g} x"


@contextmanager
def body_view(
    body: Body, style: Style | None = None, *, width: int = WIDTH, height: int = HEIGHT,
    report: Report | None = None,
) -> Iterator[GLView | FlatView]:  # fmt: skip
    """Something with `draw(positions, colours, arrows)`, see GLView.

    Raises:
        RenderingUnavailableError: MuJoCo's renderer was asked for, and there is no OpenGL.
    """
    style, report = style or Style(), report or Report()
    view: GLView | FlatView
    if style.renderer == "matplotlib":
        view = FlatView(body, width, height)
    else:
        try:
            view = GLView(body, width, height, samples=style.samples)
        except RenderingUnavailableError as error:
            if style.renderer == "mujoco":
                raise
            report.why_flat = str(error)
            view = FlatView(body, width, height)
    report.backend = view.backend
    with view:
        yield view


@contextmanager
def film_view(
    film: Film | ModelFilm, style: Style, report: Report
) -> Iterator[Callable[[int], Picture]]:
    """A function that draws the picture of a sample, given its index.

    Raises:
        RenderingUnavailableError: there is no OpenGL, and matplotlib cannot do it.
    """
    if isinstance(film, ModelFilm):
        with ModelView(film, WIDTH, HEIGHT, samples=style.samples) as model_view:
            report.backend = model_view.backend
            yield model_view.draw
        return
    with body_view(film.body, style, report=report) as view:
        yield lambda index: view.draw(
            film.drawn_positions(index), film.colours(index), film.arrows(index)
        )


def film_frames(
    film: Film | ModelFilm, style: Style | None = None, *, report: Report | None = None
) -> Iterator[Picture]:
    """Frames (480, 1024, 3) of a film: the body or model at work, beside its outputs."""
    style, report = style or Style(), report or Report()
    figure = FilmFigure(film, style.pace, WIDTH, HEIGHT, PANEL_WIDTH)
    with film_view(film, style, report) as draw:
        for index in film.pick(style.fps, style.speed):
            start = time.perf_counter()
            picture = draw(int(index))
            drawn = time.perf_counter()
            whole = figure.draw(picture, int(index))
            report.body_ms.append(1e3 * (drawn - start))
            report.frame_ms.append(1e3 * (time.perf_counter() - start))
            yield whole


def write_film(
    film: Film | ModelFilm, paths: Mapping[str, Path], style: Style | None = None, *,
    stills: int = 0,
    on_frames: OnSteps = lambda frames: None,
) -> Report:  # fmt: skip
    """Write a film, each file whole or not at all.

    Args:
        paths: by suffix, any of ".mp4", ".gif" (smaller and with fewer frames) and ".png": the
            stem of numbered stills.
        stills: number of stills, equally spaced in time, the last frame among them.
        on_frames: called with 1 after every frame, for progress bars.

    Raises:
        OutputError: a file cannot be written.
        RenderingUnavailableError: MuJoCo's renderer was asked for, and there is no OpenGL.
    """
    style, report = style or Style(), Report()
    count = len(film.pick(style.fps, style.speed))
    if count < 2:
        raise InvalidArgumentError("film", "long enough for two frames", f"{film.times[-1]:g} s")
    kept = set(np.linspace(0, count - 1, stills + 1).round().astype(int)[1:].tolist())
    with ExitStack() as stack:
        mp4 = stack.enter_context(_video(paths[".mp4"], style.fps, 1)) if ".mp4" in paths else None
        gif = (
            stack.enter_context(_video(paths[".gif"], style.fps, GIF_SHARE))
            if ".gif" in paths
            else None
        )
        for number, picture in enumerate(film_frames(film, style, report=report)):
            if mp4 is not None:
                mp4.add_image(picture)
            if gif is not None and number % GIF_SHARE == 0:
                gif.add_image(np.asarray(Image.fromarray(picture).reduce(GIF_SHARE)))
            if number in kept and ".png" in paths:
                write_picture(_numbered(paths[".png"], number), picture)
            on_frames(1)
    return report


def write_picture(path: Path, picture: Picture) -> None:
    """Write one PNG, whole or not at all."""
    with whole_file(path) as temporary:
        Image.fromarray(picture).save(temporary, format="png")


def limit_cycle_video(
    path: str | Path,
    body: Body,
    target: Target,
    times: Array,
    positions: Array,
    outputs: Array,
    *,
    seconds: float = 13.0,
) -> None:
    """MP4 in real time: the body computing, beside its phase portrait drawing itself.

    Args:
        times, positions, outputs: the same T control steps: (T,), (T, N, D), (T, n_outputs).
        seconds: length of the video, from the first sample on.

    Raises:
        OutputError: the file cannot be written.
    """
    rows = slice(round(seconds / (times[1] - times[0])) + 1)
    film = Film(
        body, times[rows], positions[rows], outputs[rows],
        forces=outputs[rows] @ body.w_fb.T, orbit=target.orbit(ORBIT_POINTS),
    )  # fmt: skip
    write_film(film, {".mp4": Path(path)})


def _video(path: Path, fps: float, share: int) -> AbstractContextManager[Video]:
    """A video file of frames `share` times smaller, and so many times fewer."""
    return new_video(path, (WIDTH + PANEL_WIDTH) // share, HEIGHT // share, fps=fps / share)


def _numbered(stem: Path, number: int) -> Path:
    return stem.with_name(f"{stem.stem}_{number:04d}.png")
