"""MP4 of any MuJoCo model at work, as MuJoCo's renderer shows it, beside its phase portrait."""

from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from mcmj.pictures.film_axes import Plane, Traces
from mcmj.pictures.opengl import new_renderer
from mcmj.pictures.rendering import write_picture
from mcmj.pictures.video_file import Picture, new_video
from mcmj.utils.validation import Array, as_array, require_number

WIDTH, HEIGHT, PANEL = 640, 480, 384  # pixels: the model's picture; width of the axes beside it
DPI = 100
FPS = 25
SHADOW = 1024  # pixels of the map
REACH = 2.6  # distance of the camera, over the size of what moves


@dataclass(frozen=True)
class ModelFilm:
    """T control steps of a model.

    Attributes:
        times: (T,) [s], equally spaced, T >= 2.
        qpos: (T, nq).
        outputs: (T, n_outputs), at least two.
        orbit: (P, n_outputs) of the target, drawn in red; None: no target.
        seconds: that the film lasts.

    Raises:
        InvalidArgumentError: wrong shapes, NaN.
    """

    model: mujoco.MjModel
    times: Array
    qpos: Array
    outputs: Array
    orbit: Array | None = None
    seconds: float = 12.0

    def __post_init__(self) -> None:
        count = len(as_array("times", self.times, (None,)))
        as_array("qpos", self.qpos, (count, self.model.nq))
        as_array("outputs", self.outputs, (count, None))
        require_number("seconds", self.seconds, 2 / FPS)

    @property
    def rows(self) -> npt.NDArray[np.int64]:
        """The steps that are shown."""
        return np.linspace(0, len(self.times) - 1, round(FPS * self.seconds)).astype(np.int64)

    @property
    def pace(self) -> str:
        """How fast the film is, in words."""
        speed = float(self.times[-1] - self.times[0]) / self.seconds
        return f"{speed:.1f} x faster" if speed > 1 else f"slowed {1 / speed:.1f} x"


def write_model_film(film: ModelFilm, path: str | Path) -> None:
    """Write a film as MP4, and its last picture as PNG beside it.

    Raises:
        RenderingUnavailableError: no OpenGL.
        OutputError: a file cannot be written.
    """
    with new_video(path, WIDTH + PANEL, HEIGHT, fps=FPS) as video:
        for picture in model_frames(film):
            video.add_image(picture)
    write_picture(Path(path).with_suffix(".png"), picture)


def model_frames(film: ModelFilm) -> Iterator[Picture]:
    """Frames (480, 1024, 3): the model, beside its outputs."""
    model, panel = copy(film.model), _Panel(film)  # a renderer changes its model
    model.vis.quality.shadowsize, model.vis.quality.offsamples = SHADOW, 0
    camera, data = mujoco.MjvCamera(), mujoco.MjData(model)
    camera.type, camera.azimuth, camera.elevation = mujoco.mjtCamera.mjCAMERA_FREE, 120.0, -20.0
    looked, camera.distance = _path(film)
    with new_renderer(model, WIDTH, HEIGHT) as renderer:
        for row, place in zip(film.rows, looked, strict=True):
            data.qpos[:] = film.qpos[row]
            mujoco.mj_fwdPosition(model, data)
            camera.lookat[:] = place
            renderer.update_scene(data, camera)
            yield np.hstack([renderer.render(), panel.draw(int(row))])


class _Panel:
    """Phase portrait and outputs, in the order of time."""

    def __init__(self, film: ModelFilm) -> None:
        self._drawn, figure = 0, Figure(figsize=(PANEL / DPI, HEIGHT / DPI), dpi=DPI)
        self._canvas = FigureCanvasAgg(figure)
        grid = figure.add_gridspec(
            2, 1, left=0.15, right=0.96, bottom=0.1, top=0.9, hspace=0.42, height_ratios=(1.9, 1.0)
        )
        self._plane = Plane(figure.add_subplot(grid[0]), film.times, film.outputs, film.orbit)
        self._traces = Traces(figure.add_subplot(grid[1]), film.times, film.outputs)
        figure.text(0.02, 0.97, film.pace, fontsize=9, va="top")
        self._canvas.draw()
        self._figure, self._ground = figure, self._canvas.copy_from_bbox(figure.bbox)

    def draw(self, row: int) -> Picture:
        """All up to a step."""
        self._canvas.restore_region(self._ground)
        new = slice(max(0, self._drawn - 1), row + 1)
        self._drawn = row + 1
        self._plane.extend(new)
        self._traces.extend(new)
        self._ground = self._canvas.copy_from_bbox(self._figure.bbox)
        self._plane.draw_trail(row)
        return np.array(Image.fromarray(np.asarray(self._canvas.buffer_rgba())).convert("RGB"))


def _centre(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Centre of mass (3,) of what moves [m]."""
    found: Array = (model.body_mass[:, None] * data.xipos).sum(axis=0) / model.body_mass.sum()
    return found


def _path(film: ModelFilm) -> tuple[Array, float]:
    """Where the camera looks in every frame (F, 3), and its distance [m].

    It goes straight along with the centre of mass, so far away that all that has mass is seen.
    """
    model, data = film.model, mujoco.MjData(film.model)
    heavy = model.body_mass[model.geom_bodyid] > 0
    centres, places = [], []
    for row in film.rows:
        data.qpos[:] = film.qpos[row]
        mujoco.mj_fwdPosition(model, data)
        centres.append(_centre(model, data))
        places.append(data.geom_xpos[heavy].copy())
    steps = np.arange(len(centres))
    looked = np.column_stack(
        [np.polyval(np.polyfit(steps, c, 1), steps) for c in np.transpose(centres)]
    )
    away = np.linalg.norm(np.array(places) - looked[:, None], axis=2) + model.geom_rbound[heavy]
    return looked, REACH * float(away.max())
