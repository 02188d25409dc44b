"""What a body file keeps beside its body: readout, provenance, how it is stepped."""

import json
from typing import Any

import mujoco
import numpy as np

from mcmj.core.callbacks.pointers import COUPLED_TAG, TAG
from mcmj.core.integrators import INTEGRATORS
from mcmj.utils.errors import BodyFileError
from mcmj.utils.validation import Array


def readout_of_model(model: mujoco.MjModel) -> Array | None:
    """The readout (L or L + 1, n_outputs) stored in the model's actuators, None without one."""
    channels = ids(model, mujoco.mjtObj.mjOBJ_ACTUATOR, "fb", model.nu)
    if len(channels) == 0 or model.nuser_actuator == 0:
        return None
    return np.ascontiguousarray(model.actuator_user[channels].T)


def provenance_of_model(model: mujoco.MjModel) -> dict[str, object] | None:
    """The account that `to_mjcf` stored of where the body comes from.

    Raises:
        BodyFileError: it is not a JSON object.
    """
    text = _text(model, "provenance")
    if text is None:
        return None
    try:
        account = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise BodyFileError(f"provenance: expected JSON ({error})") from error
    if not isinstance(account, dict):
        raise BodyFileError(f"provenance: expected a JSON object, got {text[:40]!r}")
    return account


def spring_law_of_model(model: mujoco.MjModel) -> str:
    """Name of the spring law that the model was written with."""
    return _text(model, "spring_law") or "native"


def settings_of_model(model: mujoco.MjModel) -> dict[str, Any]:
    """How the file says that its body is stepped: arguments of a Simulation."""
    step, delay, period = timing(model)
    control = period or step
    return {
        "timestep": control,
        "integrator": _integrator(model),
        "springs": spring_law_of_model(model),
        "feedback_delay": round(delay / control),
        "substeps": max(1, round(control / step)),
    }


def by_callback(model: mujoco.MjModel) -> bool:
    """Whether the springs are run by mcmj's callbacks."""
    springs = ids(model, mujoco.mjtObj.mjOBJ_TENDON, "s", model.ntendon)
    tags = model.tendon_user[springs, :1]
    return tags.size > 0 and bool(np.isin(tags, (TAG, COUPLED_TAG)).all())


def stored_numbers(model: mujoco.MjModel, name: str) -> Array | None:
    """Numbers that `to_mjcf` stored as text."""
    text = _text(model, name)
    if text is None:
        return None
    try:
        return np.array([float(word) for word in text.split()])
    except ValueError as error:
        raise BodyFileError(f"{name}: expected numbers ({error})") from error


def text_names(model: mujoco.MjModel) -> list[str]:
    """Of the texts that it has."""
    names = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_TEXT, i) for i in range(model.ntext)]
    return [name for name in names if name]


def ids(model: mujoco.MjModel, kind: mujoco.mjtObj, prefix: str, total: int) -> np.ndarray:
    """Ids of <prefix>0, <prefix>1, .. up to the first that is missing."""
    found: list[int] = []
    while len(found) < total:
        index = mujoco.mj_name2id(model, kind, f"{prefix}{len(found)}")
        if index < 0:
            break
        found.append(index)
    return np.array(found, dtype=np.int64)


def _integrator(model: mujoco.MjModel) -> str:
    """Ours, if the model has a numeric of its name; else the one of MuJoCo's that it runs."""
    running = mujoco.mjtIntegrator(model.opt.integrator).name
    found = running
    for row in INTEGRATORS.values():
        if row.by_callback:
            if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, row.name) >= 0:
                return row.name
        elif running == f"mjINT_{row.mujoco_name.upper()}":
            found = row.name
    return str(found)


def timing(model: mujoco.MjModel) -> tuple[float, float, float]:
    """Physics step, delay and sampling period of the fed-back lengths [s]; see mjcf."""
    step = float(model.opt.timestep)
    if model.nsensor == 0:
        return step, 0.0, 0.0
    delay, period = float(model.sensor_delay[0]), float(model.sensor_interval[0, 0])
    return step, delay + step / 2 if delay > 0 else 0.0, period


def _text(model: mujoco.MjModel, name: str) -> str | None:
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TEXT, name)
    if index < 0:
        return None
    start = model.text_adr[index]
    found: str = model.text_data[start : start + model.text_size[index] - 1].decode()
    return found
