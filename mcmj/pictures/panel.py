"""The side panel of a video: phase portrait and outputs that draw themselves. Takes arrays."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from mcmj.pictures.film import Window
from mcmj.utils.validation import Array

Picture = npt.NDArray[np.uint8]
Colour = tuple[int, int, int]

FINE = 2  # drawn at so many times the size, then reduced: smooth lines
TRAIL = 3.0  # seconds of outputs drawn strongly in the portrait
OUTPUT_COLOURS: tuple[Colour, ...] = ((0, 0, 0), (31, 79, 214), (42, 157, 61), (224, 123, 0))
TARGET_COLOUR, TARGET_NAME_COLOUR = (240, 170, 170), (200, 60, 60)
PAST_COLOUR, WINDOW_COLOUR = (205, 205, 205), (253, 232, 208)
AXIS_COLOUR, TEXT_COLOUR = (150, 150, 150), (70, 70, 70)
PORTRAIT_SHARE = 0.62  # of the panel's height
MARGIN = 14  # pixels


class Plot:
    """A rectangle of a picture with axes in data units."""

    def __init__(
        self, box: tuple[float, float, float, float], low: Array, high: Array, *, equal: bool
    ) -> None:
        left, top, right, bottom = box
        self.box = box
        self._low = low
        size = np.where(high > low, high - low, 1.0)
        scale = np.array([right - left, bottom - top]) / size
        self._scale = np.full(2, scale.min()) if equal else scale
        spare = np.array([right - left, bottom - top]) - self._scale * size
        self._corner = np.array([left, bottom]) + spare / 2 * np.array([1.0, -1.0])

    def pixels(self, values: Array) -> list[tuple[float, float]]:
        """Pixels of points (n, 2) in data units; y goes up."""
        at = self._corner + (values - self._low) * self._scale * np.array([1.0, -1.0])
        return list(zip(*at.T.tolist(), strict=True))


class Panel:
    """A picture on which the outputs of a film draw themselves, frame by frame, in order.

    Args:
        times, outputs: (T,) [s] and (T, n_outputs), all that will be shown.
        orbit: (P, n_outputs) of the target, or None.
        windows: stretches of time that are marked.
        width, height: [pixels].
    """

    def __init__(
        self, times: Array, outputs: Array, orbit: Array | None, windows: Sequence[Window],
        width: int, height: int,
    ) -> None:  # fmt: skip
        self._times, self._outputs = times, outputs
        shape = (FINE * width, FINE * height)
        self._ground = Image.new("RGB", shape, "white")
        self._drawn = 0  # samples that are on the ground already
        self._portrait: Plot | None = None
        if outputs.shape[1] >= 2:
            self._portrait = _portrait_plot(shape, outputs, orbit)
            self._draw_target(self._portrait, orbit)
        self._traces = _traces_plot(shape, times, outputs, below=self._portrait is not None)
        self._draw_time_axes(windows)

    def draw(self, index: int) -> Picture:
        """The panel (height, width, 3) as sample `index` is shown."""
        self._extend(index)
        picture = self._ground.copy()
        if self._portrait is not None:
            draw = ImageDraw.Draw(picture)
            first = int(np.searchsorted(self._times, self._times[index] - TRAIL))
            trail = self._portrait.pixels(_thinned(self._outputs[first : index + 1, :2]))
            _line(draw, trail, OUTPUT_COLOURS[0], 2)
            _dot(draw, trail[-1], OUTPUT_COLOURS[0], 5)
        return np.asarray(picture.reduce(FINE))

    # --- inside ------------------------------------------------------------------------------

    def _draw_target(self, portrait: Plot, orbit: Array | None) -> None:
        draw = ImageDraw.Draw(self._ground)
        words: list[tuple[str, Colour]] = [("x2 over x1", OUTPUT_COLOURS[0])]
        if orbit is not None:
            closed = np.vstack([orbit, orbit[:1]])[:, :2]
            _line(draw, portrait.pixels(_thinned(closed)), TARGET_COLOUR, 6)
            words.append(("target", TARGET_NAME_COLOUR))
        _words(draw, (FINE * MARGIN, FINE * 8), words)

    def _draw_time_axes(self, windows: Sequence[Window]) -> None:
        draw, plot = ImageDraw.Draw(self._ground), self._traces
        left, top, right, bottom = plot.box
        for window in windows:
            edges = plot.pixels(np.array([[window.start, 0.0], [window.end, 0.0]]))
            x0, x1 = max(left, edges[0][0]), min(right, edges[1][0])
            if x1 > x0:
                draw.rectangle((x0, top, x1, bottom), fill=WINDOW_COLOUR)
        for (x, y), anchor, text in (
            ((left, bottom + 6 * FINE), "la", f"{self._times[0]:g}"),
            ((right, bottom + 6 * FINE), "ra", f"{self._times[-1]:.3g} s"),
        ):
            draw.text((x, y), text, fill=TEXT_COLOUR, font=_font(13), anchor=anchor)
        zero = plot.pixels(np.array([[self._times[0], 0.0], [self._times[-1], 0.0]]))
        _line(draw, zero, AXIS_COLOUR, 1)
        names = [
            (f"x{c + 1}", OUTPUT_COLOURS[c % len(OUTPUT_COLOURS)])
            for c in range(self._outputs.shape[1])
        ]
        _words(draw, (FINE * MARGIN, top - FINE * 20), names)

    def _extend(self, index: int) -> None:
        """Bring the ground up to sample `index`: the old trail in grey, the traces."""
        draw = ImageDraw.Draw(self._ground)
        new = slice(max(0, self._drawn - 1), index + 1)
        if self._portrait is not None:
            past = self._portrait.pixels(_thinned(self._outputs[new, :2]))
            _line(draw, past, PAST_COLOUR, 1)
        for c in range(self._outputs.shape[1]):
            points = np.column_stack([self._times[new], self._outputs[new, c]])
            colour = OUTPUT_COLOURS[c % len(OUTPUT_COLOURS)]
            _line(draw, self._traces.pixels(_thinned(points)), colour, 1.5)
        self._drawn = index + 1


def _portrait_plot(shape: tuple[int, int], outputs: Array, orbit: Array | None) -> Plot:
    """The upper part of a picture, for the first two outputs and the orbit."""
    shown = outputs[:, :2] if orbit is None else np.vstack([outputs[:, :2], orbit[:, :2]])
    width, height = shape
    pad = FINE * 2 * MARGIN
    box = (pad, pad + FINE * MARGIN, width - pad, PORTRAIT_SHARE * height - pad)
    return Plot(box, shown.min(axis=0), shown.max(axis=0), equal=True)


def _traces_plot(shape: tuple[int, int], times: Array, outputs: Array, *, below: bool) -> Plot:
    """The rest of it, for the outputs over time."""
    width, height = shape
    top = PORTRAIT_SHARE * height if below else FINE * 2.0 * MARGIN
    left, right = FINE * 2 * MARGIN, width - FINE * MARGIN
    box = (left, top + FINE * MARGIN, right, height - FINE * 2.4 * MARGIN)
    reach = float(np.abs(outputs).max(initial=0.0)) or 1.0
    low, high = np.array([times[0], -reach]), np.array([times[-1], reach])
    return Plot(box, low, high, equal=False)


def _thinned(points: Array) -> Array:
    """At most a few hundred points (n, 2) of a line, its last one always."""
    stride = max(1, len(points) // 400)
    return points[(len(points) - 1) % stride :: stride]


def _line(
    draw: ImageDraw.ImageDraw, pixels: list[tuple[float, float]], colour: Colour, width: float
) -> None:
    if len(pixels) > 1:
        draw.line(pixels, fill=colour, width=round(FINE * width), joint="curve")


def _dot(draw: ImageDraw.ImageDraw, at: tuple[float, float], colour: Colour, radius: float) -> None:
    x, y, r = *at, FINE * radius
    draw.ellipse((x - r, y - r, x + r, y + r), fill=colour)


def _words(
    draw: ImageDraw.ImageDraw, at: tuple[float, float], words: list[tuple[str, Colour]]
) -> None:
    """Words beside each other, each in its colour."""
    x, y = at
    for word, colour in words:
        draw.text((x, y), word, fill=colour, font=_font(15))
        x += draw.textlength(word, font=_font(15)) + FINE * 12


def _font(size: int) -> ImageFont.ImageFont | ImageFont.FreeTypeFont:
    return ImageFont.load_default(size=FINE * size)
