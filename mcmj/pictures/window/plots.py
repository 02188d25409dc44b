"""Outputs over the last seconds, and in the phase plane, as MuJoCo's own figures in a window."""

from collections import deque

import mujoco
import numpy as np

from mcmj.utils.colours import OUTPUT_COLOURS
from mcmj.utils.validation import Array

SHOWN = 12.0  # seconds of outputs in the plot
MOST_FPS = 30


class Plots:
    """Both figures of one window."""

    def __init__(self, n_outputs: int) -> None:
        self._times: deque[float] = deque(maxlen=round(SHOWN * MOST_FPS))
        self._outputs: deque[Array] = deque(maxlen=round(SHOWN * MOST_FPS))
        self._reach = 1e-12
        colours = ("black", "blue", "green", "orange")[:n_outputs]
        self._traces, self._plane = _figure(", ".join(colours)), _figure("x2 over x1")
        self._traces.xlabel = f"x1 to x{n_outputs} over time [s]"

    def add(self, now: float, outputs: Array) -> None:
        """One sample more; time that goes back clears the plots."""
        if self._times and now < self._times[-1]:
            self._times.clear()
            self._outputs.clear()
        self._times.append(now)
        self._outputs.append(outputs)
        self._reach = max(self._reach, float(np.abs(outputs).max(initial=0.0)))

    def figures(self, width: int, height: int) -> list[tuple[mujoco.MjrRect, mujoco.MjvFigure]]:
        """Both figures at the right edge of a window of that many pixels."""
        times, outputs = np.array(self._times), np.array(self._outputs)
        reach, end = _round_up(1.05 * self._reach), times[-1]
        shown = times > end - SHOWN
        times, outputs = times[shown], outputs[shown]
        size = min(width // 3, height // 2)
        for c in range(outputs.shape[1]):
            _set_line(self._traces, c, times - end, outputs[:, c])
        self._traces.range[:] = [[-SHOWN, 0.0], [-reach, reach]]
        placed = [(mujoco.MjrRect(width - size, 0, size, size), self._traces)]
        if outputs.shape[1] >= 2:
            _set_line(self._plane, 0, outputs[:, 0], outputs[:, 1])
            self._plane.range[:] = [[-reach, reach], [-reach, reach]]
            placed.append((mujoco.MjrRect(width - size, size, size, size), self._plane))
        return placed


def _round_up(reach: float) -> float:
    """To 1, 2, 3 or 5 times a power of ten: else MuJoCo does it, on the vertical axis only."""
    power = 10.0 ** np.floor(np.log10(reach))
    return float(min(m * power for m in (1, 2, 3, 5, 10) if m * power >= reach))


def _figure(title: str) -> mujoco.MjvFigure:
    figure = mujoco.MjvFigure()
    mujoco.mjv_defaultFigure(figure)
    figure.title = title
    figure.flg_legend = 0
    figure.xformat = figure.yformat = "%.2g"
    figure.gridsize[:] = 3, 3
    figure.figurergba[:] = 1.0, 1.0, 1.0, 0.8
    figure.panergba[:] = 1.0, 1.0, 1.0, 1.0
    figure.textrgb[:] = 0.0
    figure.gridrgb[:] = 0.8
    figure.linergb[: len(OUTPUT_COLOURS)] = OUTPUT_COLOURS
    return figure


def _set_line(figure: mujoco.MjvFigure, line: int, x: Array, y: Array) -> None:
    n = min(len(x), figure.linedata.shape[1] // 2)
    figure.linepnt[line] = n
    figure.linedata[line, : 2 * n : 2] = x[-n:]
    figure.linedata[line, 1 : 2 * n : 2] = y[-n:]
