"""The recipe: one way to teach a random body a rhythm that holds.

Teacher forcing with white and slow noise and runs from total rest, then practice, from rest and
from where disturbances lead. `limit_cycle`, `perturb`, `swing_up` and `certify` all teach by it, so
that one readout does what each asks.
"""

from contextlib import suppress
from typing import Any

import numpy as np

from mcmj.core.random_body import BodySettings
from mcmj.learning.lessons import HELD, Teaching
from mcmj.learning.practice import Practice, Practised, practise
from mcmj.learning.teaching import Course, lessons_of
from mcmj.simulation.simulation import Simulation
from mcmj.targets.limit_cycles import Target
from mcmj.targets.named import require_outputs
from mcmj.utils.errors import DivergenceError
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array

# chosen on seeds 40000 to 40009, by who runs on for 380 s and comes back from rest, from blows
# and from far starts
BODIES = BodySettings(feedback_fraction=0.5)
TEACHING = Teaching(
    duration=480.0, drift=0.07, drift_time=0.3, ridge_per_row=2e-9, every=10,
    rest_runs=2, held_runs=6,
)  # fmt: skip
PRACTICE = Practice(rounds=6, good_enough=0.04)
PUSH = 10.0  # N


def train(
    simulation: Simulation,
    target: Target,
    seed: int,
    *,
    teaching: Teaching = TEACHING,
    practice: Practice = PRACTICE,
    on_steps: OnSteps = lambda steps: None,
) -> Practised:
    """Teach a target and practise it; the simulation is then on the cycle, under the readout.

    Args:
        seed: of the noise, and of a push.
        on_steps: called with the number of steps done after every chunk, for progress bars.

    Raises:
        DivergenceError: the body blew up under the teacher.
        InvalidArgumentError: the target has other outputs, or there are copies.
    """
    require_outputs(simulation, target, "simulation")
    course = Course(simulation, teaching, seed)
    course.attend_all(lessons_of(target, teaching), on_steps=on_steps)
    course.fit()
    starts = disturbed(simulation, seed)
    return practise(course, target, practice, starts=starts, on_steps=on_steps)


def training_time(target: Target, teaching: Teaching, practice: Practice) -> float:
    """Of all runs together [s], if no round of practice is needed: lessons, and a trial each
    from rest, from every output held, and from a push."""
    return teaching.total + (2 + target.n_outputs) * practice.trial


def disturbed(simulation: Simulation, seed: int) -> list[Array]:
    """Snapshots of the closed loop after disturbances of HELD seconds that it did not blow up in.

    Each output in turn stays what it is; then constant forces of up to PUSH act on all nodes. The
    simulation stays as it was.
    """
    before, steps = simulation.snapshot(), round(HELD / simulation.timestep)
    outputs = simulation.rollout(1, record=("outputs",)).get("outputs")[0]
    ways: list[dict[str, Any]] = [
        {"offset": np.tile(held * outputs, (steps, 1)), "gate": 1.0 - held}
        for held in np.eye(simulation.n_outputs)
    ]
    forces = stream(seed, "practice_push").uniform(-PUSH, PUSH, simulation.body.n_nodes)
    found = []
    for way in [*ways, {"steps": steps, "forces": forces}]:
        simulation.restore(before)
        with suppress(DivergenceError):
            simulation.rollout(**way, record=())
            found.append(simulation.snapshot())
    simulation.restore(before)
    return found
