"""What drives a body during a rollout, checked once, for every engine.

One law covers every experiment of the paper; channel c at control step k pushes with

    g_c (w_out[:, c] . lengths_k) + offset[k, c]

Teacher forcing is g = 0 with offset = teacher + noise, the closed loop g = 1 without offset.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import MOST_STEPS, Array, as_array, require_count


class Driven(Protocol):
    """What a rollout drives: a body, or any reservoir."""

    @property
    def n_inputs(self) -> int:
        """Number of input channels."""

    @property
    def n_outputs(self) -> int:
        """Number of feedback channels."""

    @property
    def n_forces(self) -> int:
        """Number of forces: of nodes, or degrees of freedom."""


@dataclass(frozen=True)
class Drive:
    """Checked arguments of a rollout; None means zero. `...` is nothing, or (copies,).

    Attributes:
        steps: number of control steps T.
        inputs: (..., T, n_inputs).
        offset: (..., T, n_outputs), added to the fed-back outputs.
        gate: (n_outputs,): 1 closes a feedback channel, 0 opens it.
        forces: (..., T, n_forces) forces on a body's nodes along its direction [N], or what acts
            on the degrees of freedom of a model [N or N m]; T = 1 if constant.
        pushes: (copies, n_bodies, 6) constant forces [N] and torques [N m] on a model's bodies.
    """

    steps: int
    inputs: Array | None
    offset: Array | None
    gate: Array
    forces: Array | None
    pushes: Array | None = None


def check_drive(
    driven: Driven,
    *,
    steps: int | None,
    inputs: object = None,
    offset: object = None,
    gate: object = None,
    forces: object = None,
    closed: bool,
    copies: int | None = None,
) -> Drive:
    """Check the arguments of a rollout; T is `steps`, or the length of what varies in time.

    Args:
        closed: what the gate is if it is not given.
        copies: size of the ensemble, whose arrays may have a leading axis of that length.

    Raises:
        InvalidArgumentError: wrong shapes, lengths that disagree, NaN, or no length at all.
    """
    constant = forces is not None and np.asarray(forces).ndim == 1
    if constant:
        forces = as_array("forces", forces, (driven.n_forces,))[None]
    arrays = {
        "inputs": series("inputs", inputs, driven.n_inputs, copies),
        "offset": series("offset", offset, driven.n_outputs, copies),
        "forces": series("forces", forces, driven.n_forces, copies),
    }
    total = common_length(steps, arrays, constant=constant)
    if gate is None:
        gate = np.full(driven.n_outputs, float(closed))
    elif np.asarray(gate).ndim == 0:
        gate = np.full(driven.n_outputs, gate)
    return Drive(steps=total, gate=as_array("gate", gate, (driven.n_outputs,)), **arrays)


def series(name: str, value: object, width: int, copies: int | None = None) -> Array | None:
    """What varies over time as an array (..., T, width), checked; None stays None."""
    if value is None:
        return None
    if copies is not None and np.asarray(value).ndim == 3:
        return as_array(name, value, (copies, None, width))
    return as_array(name, value, (None, width))


def common_length(
    steps: int | None, arrays: dict[str, Array | None], *, constant: bool = False
) -> int:
    """T: `steps`, or the length of what varies over time.

    Args:
        constant: "forces" do not vary.

    Raises:
        InvalidArgumentError: lengths that disagree, or no length at all.
    """
    lengths = {name: array.shape[-2] for name, array in arrays.items() if array is not None}
    if constant or (lengths.get("forces") == 1 and (steps is not None or len(lengths) > 1)):
        del lengths["forces"]
    if steps is None:
        if not lengths:
            raise InvalidArgumentError(
                "steps", "a number of steps, or inputs, offset or forces over time", None
            )
        steps = next(iter(lengths.values()))
    require_count("steps", steps, 1, MOST_STEPS)
    for name, length in lengths.items():
        if length != steps:
            raise InvalidArgumentError(name, f"{steps} rows, one a step", length)
    return int(steps)
