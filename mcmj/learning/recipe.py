"""The recipe: one way to teach a random body a rhythm that holds.

Teacher forcing with white and slow noise, runs from total rest, then practice. `limit_cycle`,
`perturb`, `swing_up` and `certify` all teach by it, so that one readout does what each asks.
"""

from mcmj.core.random_body import BodySettings
from mcmj.learning.lessons import Teaching
from mcmj.learning.practice import Practice, Practised, practise
from mcmj.learning.teaching import Course, lessons_of
from mcmj.simulation.reservoir import Reservoir
from mcmj.targets.limit_cycles import Target
from mcmj.targets.named import require_outputs
from mcmj.utils.progress import OnSteps

# chosen on seeds 40000 to 40009, by who runs on for 380 s and comes back from rest, from blows
# and from far starts
BODIES = BodySettings(feedback_fraction=0.5)
TEACHING = Teaching(
    duration=480.0, drift=0.07, drift_time=0.3, ridge_per_row=2e-9, every=10,
    rest_runs=2, held_runs=6,
)  # fmt: skip
PRACTICE = Practice(rounds=6, good_enough=0.04)


def train(
    simulation: Reservoir,
    target: Target,
    seed: int,
    *,
    teaching: Teaching = TEACHING,
    practice: Practice = PRACTICE,
    on_steps: OnSteps = lambda steps: None,
) -> Practised:
    """Teach a target and practise it; the simulation is then on the cycle, under the readout.

    Args:
        seed: of the noise.
        on_steps: called with the number of steps done after every chunk, for progress bars.

    Raises:
        DivergenceError: the body blew up under the teacher.
        InvalidArgumentError: the target has other outputs, or there are copies.
    """
    require_outputs(simulation, target, "simulation")
    course = Course(simulation, teaching, seed)
    course.attend_all(lessons_of(target, teaching), on_steps=on_steps)
    return practise(course, target, practice, on_steps=on_steps)
