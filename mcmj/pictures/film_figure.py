"""Frames of a film: the body's picture with words on it, beside outputs that draw themselves.

The axes are matplotlib's, drawn once; a frame restores them and draws only what is new
("blitting"). `mcmj render` prints what a frame costs.
"""

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from PIL import Image

from mcmj.mjcf.appearance import node_kinds
from mcmj.pictures.film import Film
from mcmj.pictures.film_axes import SMALL, Plane, Traces
from mcmj.utils.colours import (
    CHANGE_COLOUR,
    SHORTENED_COLOUR,
    STRETCHED_COLOUR,
)

Picture = npt.NDArray[np.uint8]

DPI = 100  # only ratios of font sizes to pixels depend on it
LARGE = 10.5  # points


class FilmFigure:
    """Draws the frames of a film in their order.

    Args:
        pace: of the film, in words.
        width, height: of the body's pictures [pixels].
        panel: width of the axes beside them [pixels].
    """

    def __init__(self, film: Film, pace: str, width: int, height: int, panel: int) -> None:
        self._film, self._width, self._drawn = film, width, 0
        self._figure = Figure(figsize=((width + panel) / DPI, height / DPI), dpi=DPI)
        self._canvas = FigureCanvasAgg(self._figure)
        share = width / (width + panel)
        words = self._figure.add_axes((0.0, 0.0, share, 1.0))
        _draw_legends(words, film)
        words.text(0.015, 0.015, "t =", fontsize=LARGE)
        self._time = words.text(0.06, 0.015, "", fontsize=LARGE, animated=True)
        self._label = words.text(
            0.5, 0.98, "", fontsize=LARGE, animated=True, color=CHANGE_COLOUR, ha="center", va="top"
        )
        scales = f"{pace}, deformation x {film.scale:g}"
        if film.largest_force > 0.0:
            scales += f", longest arrow {film.largest_force:.2g} N"
        words.text(0.17, 0.015, scales, fontsize=LARGE)
        grid = self._figure.add_gridspec(
            2, 1, left=share + 0.055, right=0.985, bottom=0.1, top=0.94, hspace=0.42,
            height_ratios=(1.9, 1.0),
        )  # fmt: skip
        has_plane = film.outputs.shape[1] >= 2
        self._plane = (
            Plane(self._figure.add_subplot(grid[0]), film.times, film.outputs, film.orbit)
            if has_plane
            else None
        )
        rows = grid[1] if has_plane else grid[:]
        self._traces = Traces(
            self._figure.add_subplot(rows), film.times, film.outputs, film.windows
        )
        self._canvas.draw()
        self._ground = self._canvas.copy_from_bbox(self._figure.bbox)
        self._no_label = self._canvas.copy_from_bbox(words.bbox)

    def draw(self, picture: Picture, index: int) -> Picture:
        """The frame of sample `index` around a picture (height, width, 3) of the body."""
        self._canvas.restore_region(self._ground)
        new = slice(max(0, self._drawn - 1), index + 1)
        self._drawn = index + 1
        for part in (self._plane, self._traces):
            if part is not None:
                part.extend(new)
        self._set_label(self._film.label(index))
        self._ground = self._canvas.copy_from_bbox(self._figure.bbox)
        if self._plane is not None:
            self._plane.draw_trail(index)
        self._time.set_text(f"{self._film.times[index]:.1f} s")
        self._figure.draw_artist(self._time)
        frame = np.array(Image.fromarray(np.asarray(self._canvas.buffer_rgba())).convert("RGB"))
        words = frame[:, : self._width]
        np.minimum(words, picture, out=words)  # the words are dark, the ground is white
        return frame

    def _set_label(self, label: str) -> None:
        """Letters take longest to draw: these are kept while they stay the same."""
        if label != self._label.get_text():
            self._canvas.restore_region(self._no_label)
            self._label.set_text(label)
            self._figure.draw_artist(self._label)


def _draw_legends(axes: Axes, film: Film) -> None:
    """Who is who at the left, what the springs' colours mean at the right."""
    axes.set_axis_off()
    nodes = [
        Line2D([], [], ls="", marker="s" if name == "fixed" else "o", color=colour, label=name)
        for name, colour in node_kinds(film.body).items()
    ]
    style = {"frameon": False, "fontsize": SMALL, "borderaxespad": 0.3}
    axes.add_artist(axes.legend(handles=nodes, loc="upper left", handlelength=1.0, **style))
    strain = film.largest_strain
    if strain > 0.0:
        springs = {"stretched": STRETCHED_COLOUR, "shortened": SHORTENED_COLOUR}
        lines = [
            Line2D([], [], color=colour, lw=3, label=f"{name} {100 * strain:.2g} %")
            for name, colour in springs.items()
        ]
        axes.legend(handles=lines, loc="upper right", **style)
