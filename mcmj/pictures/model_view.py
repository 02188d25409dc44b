"""Pictures of any MuJoCo model by its off-screen renderer, between two white bands for words."""

import os
from copy import copy

import mujoco
import numpy as np

from mcmj.pictures.film import ModelFilm
from mcmj.pictures.opengl import new_renderer
from mcmj.pictures.video_file import Picture
from mcmj.utils.validation import Array

BAND = 30  # pixels, above and below
REACH = 2.6  # distance of the camera, over the size of what moves
AZIMUTH, ELEVATION = 120.0, -20.0  # degrees
BRIGHT = 0.5  # ambient light where a model has none of its own
SHADOW = 1024  # pixels of the map: without shadows feet seem to float
SEEN = 200  # samples that say where the camera goes


class ModelView:
    """Draws samples of a film; a context manager, as the OpenGL context must be given back.

    The camera is the film's, or one that goes straight along with the centre of mass, so far away
    that all that has mass is seen.

    Args:
        width, height: of the pictures, bands included [pixels].
        samples: of multisampling; 0: none, the fastest.

    Raises:
        RenderingUnavailableError: no OpenGL context can be made.
    """

    def __init__(self, film: ModelFilm, width: int, height: int, *, samples: int = 0) -> None:
        self._film, self._model = film, copy(film.model)  # a renderer changes its model
        self._data = mujoco.MjData(self._model)
        self._model.vis.quality.offsamples = samples
        self._model.vis.quality.shadowsize = SHADOW
        if self._model.nlight == 0:
            self._model.vis.headlight.ambient[:] = BRIGHT
        skies = self._model.tex_type == mujoco.mjtTexture.mjTEXTURE_SKYBOX
        self._paint_white = not skies.any()
        self._picture = np.full((height, width, 3), 255, np.uint8)
        self._renderer = new_renderer(self._model, width, height - 2 * BAND)
        self._free = mujoco.MjvCamera()
        self._free.azimuth, self._free.elevation = AZIMUTH, ELEVATION
        self._start, self._speed, self._free.distance = _straight_path(film, self._data)
        self.backend = os.environ.get("MUJOCO_GL") or "window system"

    def __enter__(self) -> "ModelView":
        return self

    def __exit__(self, *_: object) -> None:
        self._renderer.close()

    def draw(self, index: int) -> Picture:
        """The picture (height, width, 3) of a sample."""
        film, data = self._film, self._data
        _place(film, data, index)
        self._free.lookat[:] = self._start + index * self._speed
        self._renderer.update_scene(data, camera=film.camera or self._free)
        shown = self._renderer.render()
        if self._paint_white:  # what is behind everything is black
            shown[(shown == 0).all(axis=-1)] = 255
        self._picture[BAND:-BAND] = shown
        return self._picture


def _place(film: ModelFilm, data: mujoco.MjData, index: int) -> None:
    data.qpos[:] = film.qpos[index]
    mujoco.mj_fwdPosition(film.model, data)


def _straight_path(film: ModelFilm, data: mujoco.MjData) -> tuple[Array, Array, float]:
    """Where the camera looks first (3,) [m], how it goes on (3,) [m a sample], its distance [m]."""
    model = film.model
    heavy = model.body_mass[model.geom_bodyid] > 0
    rows = np.unique(np.linspace(0, len(film.times) - 1, SEEN).astype(int))
    centres, places = [], []
    for row in rows:
        _place(film, data, int(row))
        centres.append(model.body_mass @ data.xipos / model.body_mass.sum())
        places.append(data.geom_xpos[heavy] if heavy.any() else data.xipos[1:])
        places[-1] = places[-1].copy()
    speed, start = np.polyfit(rows, np.array(centres), 1)
    looked = start + rows[:, None] * speed
    away = np.linalg.norm(np.array(places) - looked[:, None], axis=2)
    reach = away.max() + (model.geom_rbound[heavy].max() if heavy.any() else 0.0)
    return start, speed, REACH * float(reach)
