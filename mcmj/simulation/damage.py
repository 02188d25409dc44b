"""Damage to a body: springs cut, masses changed, in MuJoCo's own model fields."""

from collections.abc import Sequence

from mujoco.batch import Batch

from mcmj.core.body import Body
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, as_array, require_above, require_count

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
    for name in _NATIVE:
        batch.expand(name)[:, springs] = 0.0
    users = batch.expand("tendon_user")
    if users.shape[-1]:
        users[:, springs, 1] = 0.0


def set_masses(batch: Batch, body: Body, masses: Array) -> None:
    """Masses (N,) [kg] of the nodes; those of fixed ones do nothing."""
    batch.expand("body_mass")[:, 1:] = masses[body.free]
    batch.set_const()  # what MuJoCo derives from masses
