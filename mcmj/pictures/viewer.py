"""MuJoCo's interactive viewer on a body whose loop is closed.

The window shows a second model of the body, with its displacements magnified; what is dragged
there pulls the real body by a spring. Keys are digits that the viewer itself does not use.
"""

import os
import queue
import threading
import warnings
import xml.etree.ElementTree as ET
from collections import deque
from collections.abc import Callable

import glfw  # comes with mujoco
import mujoco
import mujoco.viewer
import numpy as np

from mcmj.core.body import Body
from mcmj.mjcf.appearance import CAMERA_ANGLE, frame, node_style
from mcmj.mjcf.read import load_model
from mcmj.mjcf.write import to_mjcf
from mcmj.pictures.film import strains
from mcmj.simulation.interactive import LiveLoop
from mcmj.utils.colours import OUTPUT_COLOURS, strain_colours
from mcmj.utils.errors import McmjError
from mcmj.utils.validation import Array

FPS = 30
CLOSING = 10.0  # seconds that the window may take to close
VIEW_SHARE = 1.25  # of the window's height to the body's
PLOTS_SHIFT, HELP_SHIFT = 0.25, 0.08  # the body stands left of the plots, above the help
SHOWN = 12.0  # seconds of outputs in the plot
DRAG_STIFFNESS = 20.0  # of the spring between mouse and node [N/m]
FREEZE_FIRST, FREEZE_SECOND, KICK, NEXT_READOUT, RESET = (ord(key) for key in "67890")
HELP = {
    "6, 7": "freeze output x1, x2, or let go", "8": "kick all nodes", "9": "next readout",
    "0": "start again", "drag a node": "double click, then Ctrl + Shift + right button",
}  # fmt: skip


class NoDisplayError(McmjError):
    """There is no screen to open a window on."""


def _require_screen() -> None:
    """MuJoCo's viewer would wait for ever for a window that cannot open."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the reason is said below
        opened = glfw.init()
        glfw.terminate()
    if not opened:
        display = os.environ.get("DISPLAY")
        raise NoDisplayError(
            f"the viewer cannot open a window (DISPLAY is {display or 'not set'}); without a "
            "screen, scripts/render.py makes films, or: apt-get install xvfb; xvfb-run -a .."
        )


def shown_model(body: Body) -> mujoco.MjModel:
    """The body for the window: the mouse can only pick geoms, so every free node gets one."""
    root = ET.fromstring(to_mjcf(body))
    for node in body.free:
        element = root.find(f".//body[@name='n{node}']")
        assert element is not None
        style = node_style(body, int(node))
        ET.SubElement(element, "geom", style, contype="0", conaffinity="0", mass="0")
    return load_model(ET.tostring(root, encoding="unicode"))


class Viewer:
    """The window; a context manager.

    Args:
        loop: what is shown and disturbed.
        scale: displacements are drawn this many times larger.
        kick: called for the kick key.

    Raises:
        NoDisplayError: there is no screen.
    """

    def __init__(self, loop: LiveLoop, scale: float, kick: Callable[[], None]) -> None:
        _require_screen()
        self._loop, self._scale, self._kick = loop, scale, kick
        self._model = shown_model(loop.body)
        self._data = mujoco.MjData(self._model)
        self._bodies = {self._model.body(f"n{i}").id: int(i) for i in loop.body.free}
        self._keys: queue.SimpleQueue[int] = queue.SimpleQueue()
        self._largest = 0.0  # strain so far, for the colours
        self._plots = Plots(loop.body.n_outputs)
        before = set(threading.enumerate())
        self._handle = mujoco.viewer.launch_passive(
            self._model, self._data, key_callback=self._keys.put,
            show_left_ui=False, show_right_ui=False,
        )  # fmt: skip
        self._threads = set(threading.enumerate()) - before
        self._look()

    def __enter__(self) -> "Viewer":
        return self

    def __exit__(self, *_: object) -> None:
        self._handle.close()
        for thread in self._threads:  # one that still draws as Python ends would crash it
            thread.join(CLOSING)

    @property
    def is_open(self) -> bool:
        """Until the window is closed."""
        return bool(self._handle.is_running())

    def press(self, key: int) -> None:
        """As if the key had been pressed in the window."""
        self._keys.put(key)

    def run_frame(self, seconds: float) -> Array:
        """Obey the keys and the mouse, run so long, show; returns the outputs (n_outputs,)."""
        self._obey_keys()
        steps = max(1, round(seconds / self._loop.timestep))
        self._loop.advance(steps, self._dragged())
        if not self._loop.alive:
            self._loop.reset()
        outputs = self._loop.outputs
        self._plots.add(self._loop.time, outputs)
        self._show()
        return outputs

    # --- inside ------------------------------------------------------------------------------

    def _look(self) -> None:
        body = self._loop.body
        cx, cy, width, height = frame(body)
        with self._handle.lock():
            camera = self._handle.cam
            if body.dimensions == 3:
                mujoco.mjv_defaultFreeCamera(self._model, camera)
                return
            extent = VIEW_SHARE * max(width, height)
            camera.lookat[:] = cx + PLOTS_SHIFT * extent, cy - HELP_SHIFT * extent, 0.0
            camera.distance = extent / 2 / np.tan(np.radians(CAMERA_ANGLE / 2))
            # not -90: dragging needs to know what is up on the screen
            camera.azimuth, camera.elevation = 90.0, -89.0

    def _obey_keys(self) -> None:
        while not self._keys.empty():
            key = self._keys.get()
            if key == KICK:
                self._kick()
            elif key == NEXT_READOUT:
                self._loop.switch_next()
            elif key == RESET:
                self._loop.reset()
            elif key in (FREEZE_FIRST, FREEZE_SECOND):
                channel = key - FREEZE_FIRST
                if channel < self._loop.body.n_outputs:
                    self._loop.freeze(channel)

    def _dragged(self) -> Array | None:
        """Forces (N, D) of the spring between the mouse and the node it holds [N]."""
        pert = self._handle.perturb
        node = self._bodies.get(pert.select)
        if node is None or not pert.active:
            return None
        away = pert.refpos - self._data.xipos[pert.select]
        forces = np.zeros_like(self._loop.body.positions)
        if forces.shape[1] == 2:
            # without Shift the mouse moves it along z: up on the screen, so take it for y
            away = np.array([away[0], away[1] + away[2]])
        forces[node] = DRAG_STIFFNESS / self._scale * away
        return forces

    def _show(self) -> None:
        body, positions = self._loop.body, self._loop.positions
        strain = strains(body, positions)
        self._largest = max(self._largest, float(np.abs(strain).max()))
        with self._handle.lock():
            shift = self._scale * (positions - body.positions)
            self._data.qpos[:] = shift[body.free].ravel()
            colours = strain_colours(strain, self._largest)
            self._model.tendon_rgba[: body.n_springs, :3] = colours
            mujoco.mj_fwdPosition(self._model, self._data)
        self._handle.sync()
        viewport = self._handle.viewport
        if viewport is not None:
            self._handle.set_figures(self._plots.figures(viewport.width, viewport.height))
        self._handle.set_texts(self._texts())

    def _texts(self) -> list[tuple[int, int, str, str]]:
        font, place = mujoco.mjtFontScale.mjFONTSCALE_100, mujoco.mjtGridPos
        loop = self._loop
        state = f"{loop.readout}   {loop.time:.1f} s   deformation x {self._scale:g}"
        for channel in np.flatnonzero(loop.frozen):
            state += f"   x{channel + 1} frozen"
        return [
            (font, place.mjGRID_TOPLEFT, state, ""),
            (font, place.mjGRID_BOTTOMLEFT, "\n".join(HELP), "\n".join(HELP.values())),
        ]


class Plots:
    """Outputs over the last seconds, and in the phase plane, as MuJoCo's own figures."""

    def __init__(self, n_outputs: int) -> None:
        self._times: deque[float] = deque(maxlen=round(SHOWN * FPS))
        self._outputs: deque[Array] = deque(maxlen=round(SHOWN * FPS))
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
