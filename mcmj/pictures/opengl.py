"""MuJoCo's off-screen renderer: EGL, else OSMesa; what there is without either.

With no display, `MUJOCO_GL` must be set before mujoco is imported: mcmj/__init__.py does it.
"""

import os
import sys

import mujoco

from mcmj.utils.errors import McmjError
from mcmj.utils.gl_backend import check_backend

REMEDY = "on Debian or Ubuntu: apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri libopengl0"


class RenderingUnavailableError(McmjError):
    """No OpenGL here; pictures of bodies by matplotlib (mcmj.pictures.flat_view) do without."""


def new_renderer(model: mujoco.MjModel, width: int, height: int) -> mujoco.Renderer:
    """A renderer of pictures of so many pixels; a context manager, to be closed after use.

    Raises:
        RenderingUnavailableError: no OpenGL context can be made.
        UnknownNameError: MUJOCO_GL is none of MuJoCo's choices.
    """
    check_backend()
    chosen = os.environ.get("MUJOCO_GL") or os.environ.get("DISPLAY")
    if sys.platform == "linux" and not chosen:
        raise RenderingUnavailableError(f"no display, no EGL and no OSMesa library; {REMEDY}")
    buffer = model.vis.global_  # as large as the largest picture of the model
    buffer.offwidth, buffer.offheight = max(buffer.offwidth, width), max(buffer.offheight, height)
    try:
        return mujoco.Renderer(model, height, width)
    except Exception as error:  # each OpenGL backend raises errors of its own
        raise RenderingUnavailableError(
            f"no off-screen OpenGL ({type(error).__name__}: {error}); {REMEDY}"
        ) from error
