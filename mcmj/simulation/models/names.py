"""What a user asks of a model by names and glob patterns: its sensors, and its actuators."""

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Any, TypeAlias

import mujoco
import numpy as np

from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.validation import require_number

Channels: TypeAlias = str | Sequence[str] | Mapping[str, Mapping[str, float]]

_SCALAR = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
_BALL = (mujoco.mjtJoint.mjJNT_BALL,)
# what can be asked for that the model has no sensor of: MJCF's sensor, its object, and the joints
# that have one
ADDABLE: dict[str, tuple[str, mujoco.mjtObj, tuple[mujoco.mjtJoint, ...]]] = {
    "jointpos": ("joint", mujoco.mjtObj.mjOBJ_JOINT, _SCALAR),
    "jointvel": ("joint", mujoco.mjtObj.mjOBJ_JOINT, _SCALAR),
    "ballquat": ("joint", mujoco.mjtObj.mjOBJ_JOINT, _BALL),
    "ballangvel": ("joint", mujoco.mjtObj.mjOBJ_JOINT, _BALL),
    "tendonpos": ("tendon", mujoco.mjtObj.mjOBJ_TENDON, ()),
    "tendonvel": ("tendon", mujoco.mjtObj.mjOBJ_TENDON, ()),
    "actuatorpos": ("actuator", mujoco.mjtObj.mjOBJ_ACTUATOR, ()),
    "actuatorvel": ("actuator", mujoco.mjtObj.mjOBJ_ACTUATOR, ()),
    "actuatorfrc": ("actuator", mujoco.mjtObj.mjOBJ_ACTUATOR, ()),
    "framepos": ("body", mujoco.mjtObj.mjOBJ_XBODY, ()),
    "framequat": ("body", mujoco.mjtObj.mjOBJ_XBODY, ()),
    "framelinvel": ("body", mujoco.mjtObj.mjOBJ_XBODY, ()),
    "frameangvel": ("body", mujoco.mjtObj.mjOBJ_XBODY, ()),
}
_NAMED = {"joint": "joints", "tendon": "tendons", "actuator": "actuators", "sensor": "sensors"}


def name_what_has_no_name(spec: mujoco.MjSpec) -> None:
    """Joints, tendons, actuators and sensors without a name get one: joint0, joint1, .."""
    for kind, plural in _NAMED.items():
        elements = getattr(spec, plural)
        taken = {element.name for element in elements}
        for place, element in enumerate(elements):
            if not element.name:
                free = f"{kind}{place}"
                while free in taken:
                    free += "_"
                element.name = free
                taken.add(free)


def resolved_sensors(spec: mujoco.MjSpec, sensors: str | Sequence[str]) -> list[str]:
    """Names of sensors of the spec, in order; those asked for as kind:object are added."""
    found: list[str] = []
    for pattern in _patterns("sensors", sensors):
        kind, colon, objects = pattern.partition(":")
        if colon and kind in ADDABLE:
            matches = [_added(spec, kind, name) for name in _objects(spec, kind, objects)]
        else:
            known = [sensor.name for sensor in spec.sensors]
            matches = _matching(pattern, known)
            if not matches:
                raise UnknownNameError("sensor", pattern, [*known, *(f"{k}:*" for k in ADDABLE)])
        found += [name for name in matches if name not in found]
    if not found:
        raise InvalidArgumentError("sensors", "at least one sensor", sensors)
    return found


def _patterns(name: str, given: Any) -> list[str]:
    found = [given] if isinstance(given, str) else given
    if not isinstance(found, Sequence) or not all(isinstance(each, str) for each in found):
        raise InvalidArgumentError(name, "a name or pattern, or a list of them", repr(given))
    return list(found)


def _matching(pattern: str, known: list[str]) -> list[str]:
    """Known names that a pattern matches; one that is a name itself, brackets and all, is that."""
    return [pattern] if pattern in known else [n for n in known if fnmatchcase(n, pattern)]


def _objects(spec: mujoco.MjSpec, kind: str, pattern: str) -> list[str]:
    """Names of the joints, tendons, actuators or bodies that a pattern matches."""
    what, _, types = ADDABLE[kind]
    if what == "body":
        known = [body.name for body in spec.bodies[1:] if body.name]
    elif types:
        known = [joint.name for joint in spec.joints if joint.type in types]
        if pattern in {joint.name for joint in spec.joints} - set(known):
            raise InvalidArgumentError(
                kind, "a hinge or slide; of ball joints ballquat: and ballangvel:, of free ones "
                "framepos:, framequat:, framelinvel: and frameangvel: with their body",
                pattern,
            )  # fmt: skip
    else:
        known = [one.name for one in getattr(spec, f"{what}s")]
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
    known = [actuator.name for actuator in spec.actuators]
    if isinstance(given, Mapping):
        return {name: _gains(kind, name, gains, known) for name, gains in given.items()}
    found: dict[str, dict[str, float]] = {}
    for pattern in _patterns(f"{kind}s", given):
        matches = _matching(pattern, known)
        if not matches:
            raise UnknownNameError(f"actuator of {kind}s", pattern, known)
        twice = [name for name in matches if name in found]
        if twice:
            raise InvalidArgumentError(f"{kind}s", "every actuator once", f"{twice[0]!r} twice")
        found |= {name: {name: 1.0} for name in matches}
    return found


def _gains(kind: str, name: str, gains: Any, known: list[str]) -> dict[str, float]:
    if not isinstance(gains, Mapping) or not gains:
        raise InvalidArgumentError(f"{kind} {name}", "{actuator: gain, ..}", repr(gains))
    for actuator, gain in gains.items():
        if actuator not in known:
            raise UnknownNameError(f"actuator of {kind} {name}", actuator, known)
        require_number(f"gain of {actuator}", gain, -np.inf)
    return dict(gains)
