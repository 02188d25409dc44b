"""Pictures of any MuJoCo model by its off-screen renderer, between two white bands for words."""

import os

import mujoco
import numpy as np

from mcmj.pictures.film import ModelFilm
from mcmj.pictures.opengl import new_renderer
from mcmj.pictures.video_file import Picture

BAND = 30  # pixels, above and below
DISTANCE = 2.2  # of the camera, in sizes of the model
AZIMUTH, ELEVATION = 120.0, -20.0  # degrees


class ModelView:
    """Draws samples of a film; a context manager, as the OpenGL context must be given back.

    Args:
        width, height: of the pictures, bands included [pixels].
        samples: of multisampling; 0: none, the fastest.

    Raises:
        RenderingUnavailableError: no OpenGL context can be made.
    """

    def __init__(self, film: ModelFilm, width: int, height: int, *, samples: int = 0) -> None:
        self._film, self._data = film, mujoco.MjData(film.model)
        film.model.vis.quality.offsamples = samples
        self._picture = np.full((height, width, 3), 255, np.uint8)
        self._renderer = new_renderer(film.model, width, height - 2 * BAND)
        self._camera = film.camera or _following(film)
        self.backend = os.environ.get("MUJOCO_GL") or "window system"

    def __enter__(self) -> "ModelView":
        return self

    def __exit__(self, *_: object) -> None:
        self._renderer.close()

    def draw(self, index: int) -> Picture:
        """The picture (height, width, 3) of a sample."""
        film, data = self._film, self._data
        data.qpos[:] = film.qpos[index]
        mujoco.mj_kinematics(film.model, data)
        mujoco.mj_comPos(film.model, data)
        mujoco.mj_camlight(film.model, data)
        mujoco.mj_tendon(film.model, data)
        self._renderer.update_scene(data, camera=self._camera)
        self._picture[BAND:-BAND] = self._renderer.render()
        return self._picture


def _following(film: ModelFilm) -> mujoco.MjvCamera:
    """A camera beside and above the first body that moves, which it follows."""
    model, camera = film.model, mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_TRACKING
    camera.trackbodyid = int(model.jnt_bodyid[0])
    data = mujoco.MjData(model)
    data.qpos[:] = film.qpos[0]
    mujoco.mj_kinematics(model, data)
    moving = data.xipos[1:]
    camera.distance = DISTANCE * max(float(np.ptp(moving, axis=0).max()), 0.2 * model.stat.extent)
    camera.azimuth, camera.elevation = AZIMUTH, ELEVATION
    return camera
