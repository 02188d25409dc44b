"""MuJoCo's interactive viewer on a reservoir whose loop is closed.

Of a model it shows the model itself; of a body a second model, with displacements magnified
(mcmj.pictures.window.body_viewer). Keys are digits that the viewer itself does not use.
"""

import os
import queue
import threading
import warnings
from collections.abc import Callable
from typing import Self

import glfw  # comes with mujoco
import mujoco
import mujoco.viewer
import numpy as np

from mcmj.pictures.window.plots import MOST_FPS, Plots
from mcmj.simulation.interactive import LiveLoop
from mcmj.utils.errors import McmjError
from mcmj.utils.validation import Array

FPS = MOST_FPS
CLOSING = 10.0  # seconds that the window may take to close
FREEZE_FIRST, FREEZE_SECOND, KICK, NEXT_READOUT, RESET = (ord(key) for key in "67890")
HELP = {
    "6, 7": "freeze output x1, x2, or let go", "8": "kick all joints", "9": "next readout",
    "0": "start again", "drag": "double click, then Ctrl + right button (+ Shift)",
}  # fmt: skip


class NoDisplayError(McmjError):
    """There is no screen to open a window on."""


def require_screen() -> None:
    """MuJoCo's viewer would wait for ever for a window that cannot open.

    Raises:
        NoDisplayError: there is no screen.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the reason is said below
        opened = glfw.init()
        glfw.terminate()
    if not opened:
        display = os.environ.get("DISPLAY")
        raise NoDisplayError(
            f"the viewer cannot open a window (DISPLAY is {display or 'not set'}); without a "
            "screen, mcmj.film(..) or `mcmj render` make films, or: apt-get install xvfb; "
            "xvfb-run -a .."
        )


class Viewer:
    """The window; a context manager.

    Args:
        loop: what is shown and disturbed.
        kick: called for the kick key.

    Raises:
        NoDisplayError: there is no screen.
    """

    def __init__(self, loop: LiveLoop, kick: Callable[[], None]) -> None:
        require_screen()
        self._loop, self._kick = loop, kick
        self._model, self._data = self._shown()
        self._keys: queue.SimpleQueue[int] = queue.SimpleQueue()
        self._plots = Plots(loop.reservoir.n_outputs)
        before = set(threading.enumerate())
        self._handle = mujoco.viewer.launch_passive(
            self._model, self._data, key_callback=self._keys.put,
            show_left_ui=False, show_right_ui=False,
        )  # fmt: skip
        self._threads = set(threading.enumerate()) - before
        self._look()

    def __enter__(self) -> Self:
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
        with self._handle.lock():
            self._loop.advance(steps, self._dragged())
            if not self._loop.alive:
                self._loop.reset()
            outputs = self._loop.outputs
            self._show()
        self._handle.sync()
        self._plots.add(self._loop.time, outputs)
        viewport = self._handle.viewport
        if viewport is not None:
            self._handle.set_figures(self._plots.figures(viewport.width, viewport.height))
        self._handle.set_texts(self._texts())
        return outputs

    # --- what a body shows otherwise ---------------------------------------------------------

    def _shown(self) -> tuple[mujoco.MjModel, mujoco.MjData]:
        """What the window shows."""
        return self._loop.model, self._loop.data

    def _look(self) -> None:
        """Where the camera stands at first: where the model says."""

    def _dragged(self) -> Array | None:
        """What the mouse pulls with (n_bodies, 6) [N], [N m]."""
        self._data.xfrc_applied[:] = 0.0
        mujoco.mjv_applyPerturbForce(self._model, self._data, self._handle.perturb)
        found: Array = self._data.xfrc_applied.copy()
        return found

    def _show(self) -> None:
        """Bring what is shown up to date."""

    @property
    def _scale_words(self) -> str:
        """How much is magnified."""
        return ""

    # --- inside ------------------------------------------------------------------------------

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
                if channel < self._loop.reservoir.n_outputs:
                    self._loop.freeze(channel)

    def _texts(self) -> list[tuple[int, int, str, str]]:
        font, place = mujoco.mjtFontScale.mjFONTSCALE_100, mujoco.mjtGridPos
        loop = self._loop
        state = f"{loop.readout}   {loop.time:.1f} s{self._scale_words}"
        for channel in np.flatnonzero(loop.frozen):
            state += f"   x{channel + 1} frozen"
        return [
            (font, place.mjGRID_TOPLEFT, state, ""),
            (font, place.mjGRID_BOTTOMLEFT, "\n".join(HELP), "\n".join(HELP.values())),
        ]
