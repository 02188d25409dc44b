"""Axes of a film that draw themselves: the phase portrait, and the outputs over time."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from mcmj.pictures.film import Window
from mcmj.utils.colours import BLACK, CHANGE_COLOUR, OUTPUT_COLOURS, TARGET_COLOUR
from mcmj.utils.validation import Array

TRAIL = 3.0  # seconds of outputs drawn strongly in the portrait
SMALL = 8.5  # points


class Plane:
    """The first two outputs against each other."""

    def __init__(self, axes: Axes, times: Array, outputs: Array, orbit: Array | None) -> None:
        self._axes, self._times, self._outputs = axes, times, outputs[:, :2]
        shown = self._outputs
        if orbit is not None:
            orbit = np.vstack([orbit, orbit[:1]])[:, :2]
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


class Traces:
    """All outputs over time."""

    def __init__(
        self, axes: Axes, times: Array, outputs: Array, windows: Sequence[Window] = ()
    ) -> None:
        self._axes, self._times, self._outputs = axes, times, outputs
        for window in windows:
            axes.axvspan(window.start, window.end, color=CHANGE_COLOUR, alpha=0.15, lw=0)
        self._lines = [
            axes.plot([], [], color=OUTPUT_COLOURS[c % len(OUTPUT_COLOURS)], lw=1.1, animated=True,
                      label=f"$x_{c + 1}$")[0]
            for c in range(outputs.shape[1])
        ]  # fmt: skip
        reach = 1.1 * float(np.abs(outputs).max(initial=0.0)) or 1.0
        axes.set(xlim=(times[0], times[-1]), ylim=(-reach, reach))
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
