"""Damage to a compiled model: springs cut, masses changed, in MuJoCo's own model fields."""

from collections.abc import Mapping, Sequence

import mujoco
from mujoco.batch import Batch

from mcmj.core.body import Body
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.validation import Array, as_array, require_above, require_count, require_number

_NATIVE = ("tendon_stiffness", "tendon_stiffnesspoly", "tendon_damping", "tendon_dampingpoly")


def checked_cut(body: Body, cut: Sequence[int]) -> tuple[int, ...]:
    """Numbers of springs that the body has.

    Raises:
        InvalidArgumentError: no such spring.
    """
    for spring in cut:
        require_count("cut", spring, 0)
        if spring >= body.n_springs:
            raise InvalidArgumentError("cut", f"springs 0 to {body.n_springs - 1}", spring)
    return tuple(int(spring) for spring in cut)


def checked_masses(body: Body, masses: object) -> Array:
    """Masses (N,) > 0 [kg].

    Raises:
        InvalidArgumentError: wrong shape, or a mass that is not positive.
    """
    array = as_array("masses", masses, (body.n_nodes,))
    require_above("masses", array, 0.0)
    return array


def cut_tendons(batch: Batch, springs: list[int]) -> None:
    """Tendons without force, native or custom (law 0 is none)."""
    _cut(batch, springs)
    users = batch.expand("tendon_user")
    if users.shape[-1]:
        users[:, springs, 1] = 0.0


def set_masses(batch: Batch, body: Body, masses: Array) -> None:
    """Masses (N,) [kg] of the nodes; those of fixed ones do nothing."""
    batch.expand("body_mass")[:, 1:] = masses[body.free]
    batch.set_const()  # what MuJoCo derives from masses


def check_model_damage(
    model: mujoco.MjModel, cut: Sequence[str], masses: Mapping[str, float]
) -> None:
    """Raise unless a model has these tendons and bodies.

    Raises:
        InvalidArgumentError: a mass that is not positive.
        UnknownNameError: no such tendon or body.
    """
    tendons = [model.tendon(i).name for i in range(model.ntendon)]
    bodies = [model.body(i).name for i in range(1, model.nbody)]
    for kind, names, known in (("tendon", cut, tendons), ("body", masses, bodies)):
        for name in names:
            if name not in known:
                raise UnknownNameError(kind, name, [each for each in known if each])
    for name, mass in masses.items():
        require_number(f"mass of {name}", mass, 0.0, open_low=True)


def alter_model(
    batch: Batch, model: mujoco.MjModel, cut: Sequence[str], masses: Mapping[str, float]
) -> None:
    """Tendons without spring and damper; masses [kg] of bodies, their inertia in proportion."""
    _cut(batch, [model.tendon(name).id for name in cut])
    for name, mass in masses.items():
        body = model.body(name).id
        batch.expand("body_inertia")[:, body] *= mass / batch.expand("body_mass")[:, body, None]
        batch.expand("body_mass")[:, body] = mass
    if masses:
        batch.set_const()  # what MuJoCo derives from masses


def _cut(batch: Batch, tendons: list[int]) -> None:
    for name in _NATIVE:
        batch.expand(name)[:, tendons] = 0.0
