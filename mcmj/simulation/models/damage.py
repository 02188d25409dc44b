"""Damage to any model: tendons cut, masses of bodies changed, in a batch and in its file.

A cut tendon has no spring, damper, friction or limit, and actuators on it pull nothing. A body's
inertia changes in proportion to its mass.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch

from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.validation import require_number

_FORCES = (
    "tendon_stiffness", "tendon_stiffnesspoly", "tendon_damping", "tendon_dampingpoly",
    "tendon_frictionloss", "tendon_limited",
)  # fmt: skip


def check_damage(model: mujoco.MjModel, cut: Any, masses: Any) -> None:
    """Raise unless a model has these tendons and bodies.

    Raises:
        InvalidArgumentError: no names, a mass that is not positive, or of a body that had none.
        UnknownNameError: no such tendon or body.
    """
    if isinstance(cut, str) or not isinstance(cut, Sequence):
        raise InvalidArgumentError("cut", "a tuple of names of tendons", repr(cut))
    if masses is not None and not isinstance(masses, Mapping):
        raise InvalidArgumentError("masses", "{name of a body: kg, ..} of a model", repr(masses))
    tendons = [model.tendon(i).name for i in range(model.ntendon)]
    bodies = [model.body(i).name for i in range(1, model.nbody)]
    for kind, names, known in (("tendon", cut, tendons), ("body", masses or {}, bodies)):
        for name in names:
            if name not in known:
                raise UnknownNameError(kind, name, [each for each in known if each])
    for name, mass in (masses or {}).items():
        require_number(f"mass of {name}", mass, 0.0, open_low=True)
        if model.body(name).mass[0] == 0.0:
            raise InvalidArgumentError("masses", "bodies that have a mass", name)


def alter_batch(
    batch: Batch, model: mujoco.MjModel, cut: Sequence[str], masses: Mapping[str, float]
) -> None:
    """Damage all copies of a model, for good."""
    tendons = [model.tendon(name).id for name in cut]
    for name in _FORCES:
        batch.expand(name)[:, tendons] = 0
    on_tendons = model.actuator_trntype == mujoco.mjtTrn.mjTRN_TENDON
    pulling = on_tendons & np.isin(model.actuator_trnid[:, 0], tendons)
    batch.expand("actuator_gear")[:, pulling] = 0.0
    for name, mass in masses.items():
        body = model.body(name).id
        batch.expand("body_inertia")[:, body] *= mass / batch.expand("body_mass")[:, body, None]
        batch.expand("body_mass")[:, body] = mass
    if masses:
        batch.set_const()  # what MuJoCo derives from masses


def write_damage(
    spec: mujoco.MjSpec, model: mujoco.MjModel, cut: Sequence[str], masses: Mapping[str, float]
) -> None:
    """The same in a spec; `model` is what it compiles to."""
    for name in cut:
        tendon = spec.tendon(name)
        tendon.stiffness, tendon.damping = 0 * tendon.stiffness, 0 * tendon.damping
        tendon.frictionloss, tendon.limited = 0.0, mujoco.mjtLimited.mjLIMITED_FALSE.value
        for actuator in spec.actuators:
            if actuator.trntype == mujoco.mjtTrn.mjTRN_TENDON and actuator.target == name:
                actuator.gear = np.zeros(6)
    for name, mass in masses.items():
        body, compiled = spec.body(name), model.body(name)
        body.explicitinertial, body.mass = True, mass
        body.ipos, body.iquat = compiled.ipos, compiled.iquat
        body.inertia, body.fullinertia = compiled.inertia * mass / compiled.mass, np.full(6, np.nan)
