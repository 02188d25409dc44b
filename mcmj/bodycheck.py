"""What a model holds that a Body cannot say: named, never dropped."""

import mujoco
import numpy as np

from mcmj.errors import BodyFileError

NONE = ("neq", "nexclude", "npair", "nflex", "nskin", "nplugin", "nmocap", "nkey", "na")
ZERO = (
    *("jnt_stiffness", "jnt_limited", "dof_damping", "dof_armature", "dof_frictionloss"),
    *("jnt_stiffnesspoly", "dof_dampingpoly", "body_gravcomp", "geom_contype", "geom_conaffinity"),
    *("tendon_limited", "tendon_armature", "tendon_frictionloss", "tendon_actfrclimited"),
    *("jnt_actfrclimited", "actuator_forcelimited", "actuator_ctrllimited", "actuator_dyntype"),
    *("actuator_damping", "actuator_armature", "actuator_delay", "sensor_noise", "sensor_cutoff"),
)
DISABLED = (
    mujoco.mjtDisableBit.mjDSBL_SPRING
    | mujoco.mjtDisableBit.mjDSBL_DAMPER
    | mujoco.mjtDisableBit.mjDSBL_ACTUATION
    | mujoco.mjtDisableBit.mjDSBL_SENSOR
    | mujoco.mjtDisableBit.mjDSBL_EULERDAMP
)


def require_only_a_body(model: mujoco.MjModel, free: int, tendons: int, channels: int) -> None:
    """Refuse what a Body of `free` free nodes, so many tendons and channels does not hold.

    Raises:
        BodyFileError: names the field of MuJoCo's model, and the first element that has it.
    """
    for name in ("gravity", "wind", "density", "viscosity"):
        if np.any(getattr(model.opt, name)):
            _refuse(f"option {name} = {getattr(model.opt, name)}")
    if model.opt.disableflags & DISABLED:
        _refuse("a flag that disables springs, dampers, actuators or sensors")
    for name in NONE:
        if getattr(model, name, 0):
            _refuse(f"{name} = {getattr(model, name)}")
    for name in ZERO:
        rows = np.atleast_1d(getattr(model, name, 0))
        bad = np.flatnonzero(rows.reshape(len(rows), -1).any(axis=1)) if rows.size else rows
        if bad.size:
            kind = {"jnt": "joint", "dof": "dof"}.get(name.split("_")[0], name.split("_")[0])
            _refuse(f"{name} of {kind} {_name(model, kind, int(bad[0]))}")
    _require_planar(model)
    wanted = {"nbody": free + 1, "njnt": 2 * free, "ntendon": tendons, "nu": channels}
    for name, number in wanted.items():
        if getattr(model, name) != number:
            _refuse(f"{name} = {getattr(model, name)} where its nodes and springs need {number}")


def _require_planar(model: mujoco.MjModel) -> None:
    """Nodes are bodies of the world at z = 0, each with slides along x and y."""
    if np.any(model.body_parentid) or np.any(model.body_pos[:, 2]) or np.any(model.site_pos[:, 2]):
        _refuse("a body inside another, or off the plane z = 0")
    slide = model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE
    along = np.isin(model.jnt_axis, (0.0, 1.0)).all() and not np.any(model.jnt_axis[:, 2])
    if not slide.all() or not along or np.any(model.body_quat[:, 1:]):
        _refuse("a joint that is not a slide along x or y")
    if np.any(model.actuator_gear[:, 0] != 1) or np.any(model.actuator_gear[:, 1:]):
        _refuse("an actuator whose gear is not 1")


def _name(model: mujoco.MjModel, kind: str, index: int) -> str:
    holder = model.joint(model.dof_jntid[index]) if kind == "dof" else getattr(model, kind)(index)
    return repr(holder.name or index)


def _refuse(what: str) -> None:
    raise BodyFileError(f"not an mcmj body: a Body cannot hold {what}")
