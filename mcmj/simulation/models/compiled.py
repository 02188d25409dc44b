"""A compiled MjModel as MjSpec: MuJoCo writes its structure, and its numbers are taken over.

A compiled model takes no actuators. MuJoCo writes as MJCF, with six digits, the one that it
compiled last from a file or string; what is compiled from that, channels and all, then gets the
numbers of the model itself, to the last bit.
"""

import tempfile
from pathlib import Path

import mujoco
import numpy as np

from mcmj.utils.errors import BodyFileError
from mcmj.utils.quiet import quiet_warnings


def spec_of_compiled(model: mujoco.MjModel) -> mujoco.MjSpec:
    """The structure of a model, with its options.

    Raises:
        BodyFileError: MuJoCo does not write this one.
    """
    try:
        with tempfile.TemporaryDirectory() as folder, quiet_warnings():
            path = Path(folder) / "model.xml"
            mujoco.mj_saveLastXML(str(path), model)
            spec = mujoco.MjSpec.from_file(str(path))
            _check_same_structure(model, spec.compile())
    except (ValueError, mujoco.FatalError) as error:
        why = " ".join(str(error).split())
        raise BodyFileError(
            f"model: MuJoCo does not write this MjModel as MJCF ({why}); give its MJCF or MjSpec"
        ) from error
    for name in dir(spec.option):
        if not name.startswith("_"):
            setattr(spec.option, name, getattr(model.opt, name))
    return spec


def take_numbers(model: mujoco.MjModel, into: mujoco.MjModel) -> None:
    """Numbers of a model, for one that begins as it does and holds more."""
    for name in dir(model):
        own = None if name.startswith("_") else getattr(model, name)
        if isinstance(own, np.ndarray) and own.dtype.kind == "f" and own.size:
            getattr(into, name)[tuple(slice(0, size) for size in own.shape)] = own
    for name in ("extent", "meaninertia", "meanmass", "meansize", "center"):
        setattr(into.stat, name, getattr(model.stat, name))


def _check_same_structure(model: mujoco.MjModel, other: mujoco.MjModel) -> None:
    """Raise ValueError unless names, types, sizes and addresses are the same."""
    if model.names != other.names:
        raise ValueError("it is not the last one that was compiled from MJCF")
    for name in dir(model):
        own = None if name.startswith("_") else getattr(model, name)
        if not isinstance(own, np.ndarray) or own.dtype.kind == "f":
            continue
        if not np.array_equal(own, getattr(other, name)):
            raise ValueError(f"{name} would change")
