"""What bodies are set to do in an environment, by name; no dm_control here.

A task is a limit cycle of `mcmj.targets.limit_cycles`, a gait of `mcmj.targets.gaits`, or the
rhythm that an input chooses (`mcmj.targets.input_systems`): "eps=1" is the quadratic system's
cycle at that eps, with the input held there.
"""

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from mcmj.core.integrators import DEFAULT_INTEGRATOR
from mcmj.learning.lessons import Teaching
from mcmj.learning.teaching import synchronise, teach
from mcmj.mjcf.bundled import StoredBody, body_names, open_body
from mcmj.mjcf.read import from_mjcf
from mcmj.mjcf.write import to_mjcf
from mcmj.simulation.reservoir import Reservoir
from mcmj.simulation.simulation import Simulation
from mcmj.targets.gaits import GAITS, LEGS
from mcmj.targets.input_systems import QUADRATIC
from mcmj.targets.limit_cycles import TARGETS, Target
from mcmj.targets.named import NAMES, named_target
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.validation import Array

DRIVEN = {f"eps={value:g}": value for value in (5.0, 1.0, 0.2)}  # those of Figs. 10 and 11
PHASES = 16  # of the cycle, that episodes start from
TEACHABLE = {2: tuple(TARGETS), len(LEGS): tuple(GAITS)}  # by the number of outputs


@dataclass(frozen=True)
class Assignment:
    """A body with its readout, and what it is to do.

    Attributes:
        simulation: of the body.
        target: the orbit.
        inputs: (n_inputs,) held all the time.
    """

    simulation: Simulation
    target: Target
    inputs: Array


def assign(name: str, task: str | None = None, **stepping: Any) -> Assignment:
    """A body by its name, or of a body file, and its task.

    Args:
        name: a body that comes with mcmj, or a path.
        task: default: the first that the file holds a readout for. Without one for it in the
            file the body is taught it first.
        stepping: timestep, integrator: as for Simulation.

    Raises:
        UnknownNameError: no such body, or no such task for it.
        InvalidArgumentError: there is no task for so many outputs.
    """
    stored = open_body(name)
    taken = stored.take(**stepping)
    body, readouts = stored.body, _taught_already(stored)
    if body.n_outputs not in TEACHABLE:
        raise InvalidArgumentError("body", "2 outputs, or 4 for gaits", body.n_outputs)
    choices = [*readouts, *TEACHABLE[body.n_outputs]]
    task = task or choices[0]
    if task not in choices:
        raise UnknownNameError(f"task of {body!r}", task, set(choices))
    w_out = (
        readouts[task]
        if task in readouts
        else _taught(to_mjcf(body), task, taken.get("integrator", DEFAULT_INTEGRATOR))
    )
    held = np.full(body.n_inputs, DRIVEN.get(task, 0.0))
    return Assignment(Simulation(body, w_out=w_out, **taken), _target(task), held)


def all_tasks() -> list[tuple[str, str]]:
    """Names of bodies that come with mcmj, and of tasks that their files hold readouts for."""
    return [(name, task) for name in body_names() for task in _taught_already(open_body(name))]


def states_on_cycle(reservoir: Reservoir, wanted: Target, inputs: Array) -> list[Array]:
    """Where clean teacher forcing from rest brings a reservoir, inputs (n_inputs,) held.

    Returns:
        PHASES of MuJoCo's integration states (n,), round the cycle; the reservoir stays as it was.
    """
    before = reservoir.snapshot()
    reservoir.reset()
    synchronise(reservoir, wanted, Teaching().washout, inputs)
    states = []
    for _ in range(PHASES):
        states.append(reservoir.in_mujoco.batch.state[0].copy())
        synchronise(reservoir, wanted, wanted.period / PHASES, inputs)
    reservoir.restore(before)
    return states


def _taught_already(stored: StoredBody) -> dict[str, Array]:
    """The readouts (L or L + 1, n_outputs) in a body file by task."""
    readouts = {task: w_out for task, w_out in stored.readouts.items() if task in NAMES}
    if stored.w_out is not None and "taught_inputs" in stored.provenance:
        readouts = dict.fromkeys(DRIVEN, stored.w_out) | readouts
    return readouts


def _target(task: str) -> Target:
    return QUADRATIC.cycle(DRIVEN[task]) if task in DRIVEN else named_target(task)


@functools.cache
def _taught(xml: str, task: str, integrator: str) -> Array:
    simulation = Simulation(from_mjcf(xml)[0], integrator=integrator)
    return teach(simulation, _target(task), Teaching(), seed=0).w_out
