"""The same pictures as opengl_view by matplotlib alone: slower, but no driver can be missing.

Bodies in space are seen along z.
"""

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.figure import Figure

from mcmj.core.body import Body
from mcmj.mjcf.appearance import NODE_SHARE, SPRING_SHARE, frame, node_colour
from mcmj.pictures.plotting import new_figure
from mcmj.utils.colours import ARROW_COLOUR
from mcmj.utils.validation import Array

Picture = npt.NDArray[np.uint8]
DPI = 100


class FlatView:
    """Draws one body with matplotlib; used like GLView."""

    backend = "matplotlib"

    def __init__(self, body: Body, width: int, height: int) -> None:
        self._body = body
        self._figure, axes = _empty_picture(body, width, height)
        points = 72 / DPI * height  # of the picture's height
        self._springs = LineCollection([], linewidths=2 * SPRING_SHARE * points, zorder=1)
        axes.add_collection(self._springs)
        area = (2 * NODE_SHARE * points) ** 2
        self._groups = [
            (nodes, _markers(axes, body, nodes, marker, area))
            for nodes, marker in ((np.flatnonzero(body.fixed), "s"), (body.free, "o"))
        ]
        self._arrows = axes.quiver(
            *body.positions[:, :2].T, *np.zeros((2, body.n_nodes)), color=ARROW_COLOUR, zorder=3,
            angles="xy", scale_units="xy", scale=1.0, width=0.005, minlength=0.0,
        )  # fmt: skip

    def __enter__(self) -> "FlatView":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def draw(self, positions: Array, colours: Array, arrows: Array) -> Picture:
        """A picture (height, width, 3) of positions (N, D), colours (L, 3) and arrows (N,)."""
        positions, (x, y) = positions[:, :2], self._body.direction[:2]
        self._springs.set_segments(list(positions[self._body.springs]))
        self._springs.set_color(list(colours))
        for nodes, markers in self._groups:
            markers.set_offsets(positions[nodes])
        self._arrows.set_offsets(positions)
        self._arrows.set_UVC(x * arrows, y * arrows)
        self._figure.canvas.draw()
        pixels = np.array(self._figure.canvas.buffer_rgba())  # type: ignore[attr-defined]  # Agg's
        return pixels[..., :3]


def _empty_picture(body: Body, width: int, height: int) -> tuple[Figure, Axes]:
    """A figure of that many pixels that shows what MuJoCo's camera over the body shows."""
    figure = new_figure(width / DPI, height / DPI)
    figure.set_dpi(DPI)
    figure.set_layout_engine("none")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    cx, cy, wide, tall = frame(body)
    half = max(wide, tall) / 2
    axes.set(xlim=(cx - half * width / height, cx + half * width / height))
    axes.set(ylim=(cy - half, cy + half))
    return figure, axes


def _markers(
    axes: Axes, body: Body, nodes: npt.NDArray[np.int64], marker: str, area: float
) -> PathCollection:
    colours = [node_colour(body, int(node)) for node in nodes]
    x, y = body.positions[nodes, :2].T
    return axes.scatter(x, y, s=area, c=colours, marker=marker, linewidths=0, zorder=2)
