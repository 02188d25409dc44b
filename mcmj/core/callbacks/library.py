"""Functions of MuJoCo's C library, for compiled code: their addresses in this process."""

import ctypes
import functools
from pathlib import Path

import mujoco

from mcmj.utils.errors import McmjError


@functools.cache
def function_address(name: str) -> int:
    """The address of a function of MuJoCo's C interface, "mj_step" say.

    Raises:
        McmjError: MuJoCo's library is not where its wheels have it.
    """
    folder = Path(mujoco.__file__).parent
    for pattern in ("libmujoco*.so*", "libmujoco*.dylib", "mujoco.dll"):
        for library in sorted(folder.glob(pattern)):
            function = getattr(ctypes.CDLL(str(library)), name)
            return int(ctypes.cast(function, ctypes.c_void_p).value or 0)
    raise McmjError(f"no MuJoCo library in {folder}")
