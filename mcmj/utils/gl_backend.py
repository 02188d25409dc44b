"""Which OpenGL MuJoCo draws with off-screen: MUJOCO_GL, which it reads when it is imported."""

import ctypes.util
import os
import sys

from mcmj.utils.errors import UnknownNameError

# as in mujoco/rendering/classic/gl_context.py
_OFF = ("off", "disable", "disabled", "false", "0")
_ANY = ("", "on", "enable", "enabled", "true", "1")
_OF_PLATFORM = {"linux": ("glx", "egl", "osmesa"), "win32": ("wgl",), "darwin": ("cgl",)}
_CHOICES = ("off", "glfw", *_OF_PLATFORM.get(sys.platform, ()))
_refused: list[str] = []


def choose_backend() -> None:
    """Set MUJOCO_GL before MuJoCo is imported: without a display it must be told.

    A value that MuJoCo would refuse, so that its import failed, becomes "off"; `check_backend`
    says so.
    """
    given = os.environ.get("MUJOCO_GL")
    if given is not None:
        if given.lower().strip() not in {*_OFF, *_ANY, *_CHOICES}:
            _refused.append(given)
            os.environ["MUJOCO_GL"] = "off"
        return
    if sys.platform != "linux" or os.environ.get("DISPLAY"):
        return
    for backend, library in (("egl", "EGL"), ("osmesa", "OSMesa")):
        if ctypes.util.find_library(library):
            os.environ["MUJOCO_GL"] = backend
            return


def check_backend() -> None:
    """Raise unless MUJOCO_GL was one of MuJoCo's choices.

    Raises:
        UnknownNameError: it was not.
    """
    if _refused:
        raise UnknownNameError("MUJOCO_GL", _refused[0], _CHOICES)
