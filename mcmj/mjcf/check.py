"""What a model holds that a Body cannot say: named, never dropped.

A Body that was read from a model is written again and compiled: every field that physics
depends on must be the model's own. So nothing must be thought of that a file could ask for.
"""

import re

import mujoco
import numpy as np

from mcmj.utils.errors import BodyFileError

# what changes no motion here: looks, what MuJoCo derives, what only contacts, limits or rotations
# use; user data, which is read by itself; and what several steps, delays or laws differ in
_PER_ELEMENT = re.compile(r"(body|jnt|dof|tendon|wrap|actuator|sensor)_|site_(bodyid|pos)|qpos")
_HARMLESS = re.compile(
    r".*_(user|group|rgba|matid|width|sol(ref|imp|mix)\w*|range|margin|invweight0|sameframe"
    r"|treeid|treenum|Madr|simple\w*|bvh\w+|geom\w+|con(type|affinity)|lengthrange|ctrlrange|forcerange)"
    r"|body_(mass|subtreemass|inertia|ipos|iquat)|jnt_pos|(dof|tendon|actuator)_(M0|length0?|acc0)"
)
_ROUNDED = {"sensor_delay", "sensor_interval"}  # sums of steps
_NONE = ("neq", "npair", "nexclude", "nflex", "nskin", "nplugin", "nmocap", "nkey", "na")
_OPTIONS = ("gravity", "wind", "density", "viscosity", "disableactuator", "enableflags")
_NAMED = ("body", "joint", "site", "tendon", "actuator", "sensor")
_DISABLED = (
    mujoco.mjtDisableBit.mjDSBL_SPRING
    | mujoco.mjtDisableBit.mjDSBL_DAMPER
    | mujoco.mjtDisableBit.mjDSBL_ACTUATION
    | mujoco.mjtDisableBit.mjDSBL_SENSOR
    | mujoco.mjtDisableBit.mjDSBL_EULERDAMP
)


def require_same_physics(model: mujoco.MjModel, again: mujoco.MjModel) -> None:
    """Refuse a model whose Body, written and compiled `again`, is another model.

    Raises:
        BodyFileError: names the field of MuJoCo's model, the element, and both values.
    """
    for name in _NONE:
        if getattr(model, name, 0):
            _refuse(name, getattr(model, name), 0)
    for name in _OPTIONS:
        found, said = getattr(model.opt, name), getattr(again.opt, name)
        if np.any(found != said):
            _refuse(f"option {name}", found, said)
    if model.opt.disableflags & _DISABLED:
        _refuse("a flag disables springs, dampers, actuators or sensors", "set", "unset")
    for name in ("geom_contype", "geom_conaffinity"):
        bad = np.flatnonzero(getattr(model, name))
        if bad.size:
            _refuse(f"{name} of geom {model.geom(int(bad[0])).name!r}", "not 0", "no contact")
    for kind in _NAMED:
        _require_same_names(kind, _names(model, kind), _names(again, kind))
    for name in dir(again):
        if _PER_ELEMENT.match(name) and not _HARMLESS.fullmatch(name):
            _require_same_rows(name, model, again)


def _require_same_names(kind: str, found: list[str], said: list[str]) -> None:
    if found == said:
        return
    extra = [name for name in found if name not in said]
    missing = [name for name in said if name not in found]
    if extra:
        _refuse(f"{kind} {extra[0]!r}", "there is one", "none")
    if missing:
        _refuse(f"{kind} {missing[0]!r}", "none", "there is one")
    _refuse(f"the order of {kind} names", found, said)


def _require_same_rows(name: str, model: mujoco.MjModel, again: mujoco.MjModel) -> None:
    found, said = np.asarray(getattr(model, name)), np.asarray(getattr(again, name))
    if found.shape != said.shape:
        _refuse(f"the size of {name}", found.shape, said.shape)
    same = np.isclose(found, said, rtol=1e-6) if name in _ROUNDED else found == said
    if not same.all():
        row = int(np.argwhere(~same)[0][0])
        _refuse(f"{name} of {_element(model, name, row)}", found[row], said[row])


def _names(model: mujoco.MjModel, kind: str) -> list[str]:
    number = {"joint": "njnt", "actuator": "nu"}.get(kind, f"n{kind}")
    return [getattr(model, kind)(i).name for i in range(getattr(model, number))]


def _element(model: mujoco.MjModel, field: str, row: int) -> str:
    kind = {"jnt": "joint", "qpos": "joint", "qpos0": "joint"}.get(field.split("_")[0])
    kind = kind or field.split("_")[0]
    if kind == "dof":
        return f"joint {model.joint(int(model.dof_jntid[row])).name!r}"
    if kind in _NAMED:
        return f"{kind} {getattr(model, kind)(row).name!r}"
    return f"{kind} {row}"


def _refuse(what: str, found: object, said: object) -> None:
    shown = [" ".join(str(value).split())[:80] for value in (found, said)]
    raise BodyFileError(f"not an mcmj body: {what}: {shown[0]}, where a Body says {shown[1]}")
