"""What a user asks of a model by names and glob patterns: its sensors, and its actuators."""

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from typing import TypeAlias

import mujoco
import numpy as np

from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.validation import require_number

Channels: TypeAlias = Sequence[str] | Mapping[str, Mapping[str, float]]

# what can be asked for that the model has no sensor of: MJCF's sensor, and its object
ADDABLE = {
    "jointpos": ("joint", mujoco.mjtObj.mjOBJ_JOINT),
    "jointvel": ("joint", mujoco.mjtObj.mjOBJ_JOINT),
    "tendonpos": ("tendon", mujoco.mjtObj.mjOBJ_TENDON),
    "tendonvel": ("tendon", mujoco.mjtObj.mjOBJ_TENDON),
    "actuatorpos": ("actuator", mujoco.mjtObj.mjOBJ_ACTUATOR),
    "actuatorvel": ("actuator", mujoco.mjtObj.mjOBJ_ACTUATOR),
    "actuatorfrc": ("actuator", mujoco.mjtObj.mjOBJ_ACTUATOR),
}


def resolved_sensors(spec: mujoco.MjSpec, sensors: str | Sequence[str]) -> list[str]:
    """Names of sensors of the spec, in order; those asked for as kind:object are added."""
    found: list[str] = []
    for pattern in [sensors] if isinstance(sensors, str) else sensors:
        kind, colon, objects = pattern.partition(":")
        if colon and kind in ADDABLE:
            matches = [_added(spec, kind, name) for name in _objects(spec, kind, objects)]
        else:
            known = [sensor.name for sensor in spec.sensors if sensor.name]
            matches = _matching(pattern, known)
            if not matches:
                raise UnknownNameError("sensor", pattern, [*known, *(f"{k}:*" for k in ADDABLE)])
        found += [name for name in matches if name not in found]
    if not found:
        raise InvalidArgumentError("sensors", "at least one sensor", sensors)
    return found


def _matching(pattern: str, known: list[str]) -> list[str]:
    """Known names that a pattern matches; one that is a name itself, brackets and all, is that."""
    return [pattern] if pattern in known else [n for n in known if fnmatchcase(n, pattern)]


def _objects(spec: mujoco.MjSpec, kind: str, pattern: str) -> list[str]:
    """Names of the joints, tendons or actuators that a pattern matches."""
    what, _ = ADDABLE[kind]
    known = [one.name for one in getattr(spec, f"{what}s") if one.name]
    if what == "joint":
        scalar = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
        known = [joint.name for joint in spec.joints if joint.name and joint.type in scalar]
    matches = _matching(pattern, known)
    if not matches:
        raise UnknownNameError(f"{what} (of sensor {kind})", pattern, known)
    return matches


def _added(spec: mujoco.MjSpec, kind: str, name: str) -> str:
    """Name of a sensor of that kind of that object, added if there is none."""
    full = f"{kind}:{name}"
    if full not in [sensor.name for sensor in spec.sensors]:
        what = getattr(mujoco.mjtSensor, f"mjSENS_{kind.upper()}")
        spec.add_sensor(name=full, type=what, objtype=ADDABLE[kind][1], objname=name)
    return full


def resolved_channels(
    spec: mujoco.MjSpec, kind: str, given: Channels
) -> dict[str, dict[str, float]]:
    """The gain of each actuator, by channel."""
    known = [actuator.name for actuator in spec.actuators if actuator.name]
    if isinstance(given, Mapping):
        for name, gains in given.items():
            for actuator, gain in gains.items():
                if actuator not in known:
                    raise UnknownNameError(f"actuator of {kind} {name}", actuator, known)
                require_number(f"gain of {actuator}", gain, -np.inf)
        return {name: dict(gains) for name, gains in given.items()}
    found: dict[str, dict[str, float]] = {}
    for pattern in [given] if isinstance(given, str) else given:
        matches = _matching(pattern, known)
        if not matches:
            raise UnknownNameError(f"actuator of {kind}s", pattern, known)
        found |= {name: {name: 1.0} for name in matches}
    return found
