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
from mcmj.pictures.film import Film, Recording
from mcmj.utils.colours import (
    BLACK,
    CHANGE_COLOUR,
    OUTPUT_COLOURS,
    SHORTENED_COLOUR,
    STRETCHED_COLOUR,
    TARGET_COLOUR,
)

Picture = npt.NDArray[np.uint8]

DPI = 100  # only ratios of font sizes to pixels depend on it
TRAIL = 3.0  # seconds of outputs drawn strongly in the portrait
SMALL, LARGE = 8.5, 10.5  # points
MOST_LABELS = 6  # of outputs in the legend


class FilmFigure:
    """Draws the frames of a film in their order.

    Args:
        pace: of the film, in words.
        width, height: of the body's pictures [pixels].
        panel: width of the axes beside them [pixels].
    """

    def __init__(self, film: Recording, pace: str, width: int, height: int, panel: int) -> None:
        self._film, self._width, self._drawn = film, width, 0
        self._figure = Figure(figsize=((width + panel) / DPI, height / DPI), dpi=DPI)
        self._canvas = FigureCanvasAgg(self._figure)
        share = width / (width + panel)
        words = self._figure.add_axes((0.0, 0.0, share, 1.0))
        words.set_axis_off()
        if isinstance(film, Film):
            _draw_legends(words, film)
        words.text(0.015, 0.015, "t =", fontsize=LARGE)
        self._time = words.text(0.06, 0.015, "", fontsize=LARGE, animated=True)
        self._label = words.text(
            0.5, 0.98, "", fontsize=LARGE, animated=True, color=CHANGE_COLOUR, ha="center", va="top"
        )
        words.text(0.17, 0.015, pace + film.scales, fontsize=LARGE)
        grid = self._figure.add_gridspec(
            2, 1, left=share + 0.062, right=0.99, bottom=0.1, top=0.94, hspace=0.42,
            height_ratios=(1.9, 1.0),
        )  # fmt: skip
        has_plane = film.outputs.shape[1] >= 2
        self._plane = _Plane(self._figure.add_subplot(grid[0]), film) if has_plane else None
        rows = grid[1] if has_plane else grid[:]
        self._traces = _Traces(self._figure.add_subplot(rows), film)
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


class _Plane:
    """The first two outputs against each other."""

    def __init__(self, axes: Axes, film: Recording) -> None:
        self._axes, self._times, self._outputs = axes, film.times, film.outputs[:, :2]
        shown = self._outputs
        if film.orbit is not None:
            orbit = np.vstack([film.orbit, film.orbit[:1]])[:, :2]
            axes.plot(*orbit.T, color=TARGET_COLOUR, lw=3, alpha=0.55, label="target")
            shown = np.vstack([shown, orbit])
        (self._past,) = axes.plot([], [], color="0.8", lw=0.7, animated=True)
        (self._trail,) = axes.plot([], [], color=BLACK, lw=1.4, animated=True, label="output")
        (self._now,) = axes.plot([], [], "o", color=BLACK, ms=6, animated=True)
        axes.update_datalim(shown)
        axes.margins(0.06)
        axes.autoscale_view()
        axes.set_aspect("equal", adjustable="datalim")
        _label_axes(axes, "$x_1$", "$x_2$")

    def extend(self, new: slice) -> None:
        """Draw samples for good."""
        self._past.set_data(*self._outputs[new].T)
        self._axes.draw_artist(self._past)

    def draw_trail(self, index: int) -> None:
        """Draw the last seconds before a sample."""
        first = int(np.searchsorted(self._times, self._times[index] - TRAIL))
        self._trail.set_data(*self._outputs[first : index + 1].T)
        self._now.set_data(self._outputs[index : index + 1].T)
        for line in (self._trail, self._now):
            self._axes.draw_artist(line)


class _Traces:
    """All outputs over time."""

    def __init__(self, axes: Axes, film: Recording) -> None:
        self._axes, self._times, self._outputs = axes, film.times, film.outputs
        for window in film.windows:
            axes.axvspan(window.start, window.end, color=CHANGE_COLOUR, alpha=0.15, lw=0)
        self._lines = [
            axes.plot([], [], color=OUTPUT_COLOURS[c % len(OUTPUT_COLOURS)], lw=1.1, animated=True,
                      label=f"$x_{{{c + 1}}}$" if c < MOST_LABELS else None)[0]
            for c in range(film.outputs.shape[1])
        ]  # fmt: skip
        reach = 1.1 * float(np.abs(film.outputs).max(initial=0.0)) or 1.0
        axes.set(xlim=(film.times[0], film.times[-1]), ylim=(-reach, reach))
        _label_axes(axes, "time [s]", "outputs")

    def extend(self, new: slice) -> None:
        """Draw samples for good."""
        for line, values in zip(self._lines, self._outputs.T, strict=True):
            line.set_data(self._times[new], values[new])
            self._axes.draw_artist(line)


def _label_axes(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(x, fontsize=SMALL, labelpad=1)
    axes.set_ylabel(y, fontsize=SMALL, labelpad=1)
    axes.tick_params(labelsize=SMALL)
    axes.spines[["right", "top"]].set_visible(False)
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(
        handles, labels, loc="lower right", ncols=len(labels),
        bbox_to_anchor=(1.0, 0.98), borderpad=0.0, fontsize=SMALL, frameon=False,
    )  # fmt: skip


def _draw_legends(axes: Axes, film: Film) -> None:
    """Who is who at the left, what the springs' colours mean at the right."""
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
