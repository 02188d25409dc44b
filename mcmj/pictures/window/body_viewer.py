"""A body in the viewer: springs coloured by strain, displacements magnified.

The window shows a second model of the body; what is dragged there pulls the real body by a spring.
"""

import xml.etree.ElementTree as ET
from collections.abc import Callable

import mujoco
import numpy as np

from mcmj.core.body import Body
from mcmj.mjcf.appearance import CAMERA_ANGLE, frame, node_style
from mcmj.mjcf.read import load_model
from mcmj.mjcf.write import to_mjcf
from mcmj.pictures.film import strains
from mcmj.pictures.window.viewer import Viewer
from mcmj.simulation.interactive import LiveLoop
from mcmj.utils.colours import strain_colours
from mcmj.utils.validation import Array

VIEW_SHARE = 1.25  # of the window's height to the body's
PLOTS_SHIFT, HELP_SHIFT = 0.25, 0.08  # the body stands left of the plots, above the help
DRAG_STIFFNESS = 20.0  # of the spring between mouse and node [N/m]


def shown_model(body: Body) -> mujoco.MjModel:
    """The body for the window: the mouse can only pick geoms, so every free node gets one."""
    root = ET.fromstring(to_mjcf(body))
    for node in body.free:
        element = root.find(f".//body[@name='n{node}']")
        assert element is not None
        style = node_style(body, int(node))
        ET.SubElement(element, "geom", style, contype="0", conaffinity="0", mass="0")
    return load_model(ET.tostring(root, encoding="unicode"))


class BodyViewer(Viewer):
    """The window of a body; see Viewer.

    Args:
        scale: displacements are drawn this many times larger.
    """

    def __init__(
        self, loop: LiveLoop, kick: Callable[[], None], *, body: Body, scale: float
    ) -> None:
        self._body, self._scale = body, scale
        self._largest = 0.0  # strain so far, for the colours
        super().__init__(loop, kick)
        self._bodies = {self._model.body(f"n{i}").id: int(i) for i in body.free}

    def _shown(self) -> tuple[mujoco.MjModel, mujoco.MjData]:
        model = shown_model(self._body)
        return model, mujoco.MjData(model)

    def _look(self) -> None:
        """From above; at a body in space from aside."""
        cx, cy, width, height = frame(self._body)
        with self._handle.lock():
            camera = self._handle.cam
            if self._body.dimensions == 3:
                mujoco.mjv_defaultFreeCamera(self._model, camera)
                return
            extent = VIEW_SHARE * max(width, height)
            camera.lookat[:] = cx + PLOTS_SHIFT * extent, cy - HELP_SHIFT * extent, 0.0
            camera.distance = extent / 2 / np.tan(np.radians(CAMERA_ANGLE / 2))
            # not -90: dragging needs to know what is up on the screen
            camera.azimuth, camera.elevation = 90.0, -89.0

    def _dragged(self) -> Array | None:
        """Of the spring between the mouse and the node it holds."""
        held = self._handle.perturb
        node = self._bodies.get(held.select)
        if node is None or not held.active:
            return None
        away = held.refpos - self._data.xipos[held.select]
        pushes = np.zeros((self._loop.model.nbody, 6))
        if self._body.dimensions == 2:
            # without Shift the mouse moves it along z: up on the screen, so take it for y
            away = np.array([away[0], away[1] + away[2], 0.0])
        pushes[self._loop.model.body(f"n{node}").id, :3] = DRAG_STIFFNESS / self._scale * away
        return pushes

    def _show(self) -> None:
        body, moved = self._body, self._loop.data.qpos
        positions = body.positions.copy()
        positions[body.free] += moved.reshape(-1, body.dimensions)
        strain = strains(body, positions)
        self._largest = max(self._largest, float(np.abs(strain).max()))
        self._data.qpos[:] = self._scale * moved
        self._model.tendon_rgba[: body.n_springs, :3] = strain_colours(strain, self._largest)
        mujoco.mj_fwdPosition(self._model, self._data)

    @property
    def _scale_words(self) -> str:
        return f"   deformation x {self._scale:g}"
