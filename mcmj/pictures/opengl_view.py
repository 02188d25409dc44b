"""Pictures of a body by MuJoCo's off-screen renderer: EGL, else OSMesa.

With no display, `MUJOCO_GL` must be set before mujoco is imported: mcmj/__init__.py does it.
"""

import os
import sys

import mujoco
import numpy as np
import numpy.typing as npt

from mcmj.core.body import Body
from mcmj.mjcf.appearance import ARROW_COLOUR, frame, strain_colours
from mcmj.mjcf.read import load_model
from mcmj.mjcf.write import to_mjcf
from mcmj.utils.errors import McmjError
from mcmj.utils.validation import Array

Picture = npt.NDArray[np.uint8]

REMEDY = "on Debian or Ubuntu: apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri libopengl0"
ARROW_WIDTH = 0.006  # of the view


class RenderingUnavailableError(McmjError):
    """No OpenGL here; pictures by matplotlib (mcmj.flatview) do without."""


class GLView:
    """Draws one body off-screen; a context manager, as the OpenGL context must be given back.

    Args:
        width, height: of the pictures [pixels].
        samples: of multisampling; 0: none, the fastest.

    Raises:
        RenderingUnavailableError: no OpenGL context can be made.
    """

    def __init__(self, body: Body, width: int, height: int, *, samples: int = 0) -> None:
        self._body = body
        self._model = model = load_model(to_mjcf(body))
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        model.vis.quality.offsamples = samples
        self._data = mujoco.MjData(model)
        self._extent = max(frame(body)[2:])
        self._renderer = _renderer(model, width, height)
        # the white sky is half the cost of a picture in software; smoothed edges need it
        self._paint_white = samples == 0
        self._renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SKYBOX] = not self._paint_white
        self.backend = os.environ.get("MUJOCO_GL") or "window system"

    def __enter__(self) -> "GLView":
        return self

    def __exit__(self, *_: object) -> None:
        self._renderer.close()

    def draw(self, positions: Array, strains: Array, arrows: Array) -> Picture:
        """A picture (height, width, 3).

        Args:
            positions: (N, 2) of the nodes as drawn [m].
            strains: (L,) in [-1, 1], for the springs' colours.
            arrows: (N,) lengths of horizontal arrows at the nodes [m].
        """
        model, data, body = self._model, self._data, self._body
        data.qpos[:] = (positions - body.positions)[body.free].ravel()
        model.tendon_rgba[: body.n_springs, :3] = strain_colours(strains)
        mujoco.mj_fwdPosition(model, data)
        self._renderer.update_scene(data, camera="top")
        for node in np.flatnonzero(np.abs(arrows) > 0.01 * self._extent):
            self._add_arrow(positions[node], float(arrows[node]))
        picture = self._renderer.render()
        if self._paint_white:
            empty = (picture[..., 0] | picture[..., 1] | picture[..., 2]) == 0
            picture += np.uint8(255) * empty[..., None]
        return picture

    def _add_arrow(self, start: Array, length: float) -> None:
        scene, height = self._renderer.scene, 0.03 * self._extent  # above nodes and springs
        if scene.ngeom >= scene.maxgeom:
            return
        geom = scene.geoms[scene.ngeom]
        scene.ngeom += 1
        kind = mujoco.mjtGeom.mjGEOM_ARROW
        colour = np.array([*ARROW_COLOUR, 1.0], dtype=np.float32)
        mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.eye(3).ravel(), colour)
        # MuJoCo draws an arrow half as long as it says
        tip = np.array([start[0] + 2.0 * length, start[1], height])
        origin = np.array([start[0], start[1], height])
        mujoco.mjv_connector(geom, kind, ARROW_WIDTH * self._extent, origin, tip)


def _renderer(model: mujoco.MjModel, width: int, height: int) -> mujoco.Renderer:
    chosen = os.environ.get("MUJOCO_GL") or os.environ.get("DISPLAY")
    if sys.platform == "linux" and not chosen:
        raise RenderingUnavailableError(f"no display, no EGL and no OSMesa library; {REMEDY}")
    try:
        return mujoco.Renderer(model, height, width)
    except Exception as error:  # each OpenGL backend raises errors of its own
        raise RenderingUnavailableError(
            f"no off-screen OpenGL ({type(error).__name__}: {error}); {REMEDY}"
        ) from error
