"""Pictures of a body by MuJoCo's off-screen renderer."""

import os

import mujoco
import numpy as np
import numpy.typing as npt

from mcmj.core.body import Body
from mcmj.mjcf.appearance import camera_of, frame
from mcmj.mjcf.read import load_model
from mcmj.mjcf.write import to_mjcf
from mcmj.pictures.opengl import new_renderer
from mcmj.utils.colours import ARROW_COLOUR
from mcmj.utils.validation import Array

Picture = npt.NDArray[np.uint8]

ARROW_WIDTH = 0.006  # of the view


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
        model.vis.quality.offsamples = samples
        self._data = mujoco.MjData(model)
        self._extent = max(frame(body)[2:])
        self._renderer = new_renderer(model, width, height)
        # the white sky is half the cost of a picture in software; smoothed edges need it
        self._paint_white = samples == 0
        self._renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SKYBOX] = not self._paint_white
        self.backend = os.environ.get("MUJOCO_GL") or "window system"

    def __enter__(self) -> "GLView":
        return self

    def __exit__(self, *_: object) -> None:
        self._renderer.close()

    def draw(self, positions: Array, colours: Array, arrows: Array) -> Picture:
        """A picture (height, width, 3).

        Args:
            positions: (N, D) of the nodes as drawn [m].
            colours: (L, 3) of the springs.
            arrows: (N,) lengths of arrows at the nodes, along the body's direction [m].
        """
        model, data, body = self._model, self._data, self._body
        data.qpos[:] = (positions - body.positions)[body.free].ravel()
        model.tendon_rgba[: body.n_springs, :3] = colours
        mujoco.mj_fwdPosition(model, data)
        self._renderer.update_scene(data, camera=camera_of(body))
        for node in np.flatnonzero(np.abs(arrows) > 0.01 * self._extent):
            self._add_arrow(positions[node], float(arrows[node]))
        picture: Picture = self._renderer.render()
        if self._paint_white:
            empty = (picture[..., 0] | picture[..., 1] | picture[..., 2]) == 0
            picture += np.uint8(255) * empty[..., None]
        return picture

    def _add_arrow(self, start: Array, length: float) -> None:
        scene, body = self._renderer.scene, self._body
        if scene.ngeom >= scene.maxgeom:
            return
        geom = scene.geoms[scene.ngeom]
        scene.ngeom += 1
        kind = mujoco.mjtGeom.mjGEOM_ARROW
        colour = np.array([*ARROW_COLOUR, 1.0], dtype=np.float32)
        mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.eye(3).ravel(), colour)
        # MuJoCo draws an arrow half as long as it says
        reach = 2.0 * length * body.direction
        if body.dimensions == 2:  # above nodes and springs
            start, reach = np.append(start, 0.03 * self._extent), np.append(reach, 0.0)
        mujoco.mjv_connector(geom, kind, ARROW_WIDTH * self._extent, start, start + reach)
