"""What the integrator does to the learned attractor: taught under one, run under another."""

from mcmj.core.body import Body
from mcmj.core.integrators import INTEGRATORS
from mcmj.learning.lessons import Teaching
from mcmj.learning.teaching import synchronise, teach
from mcmj.metrics.orbits import orbit_error
from mcmj.simulation.simulation import Simulation
from mcmj.targets.limit_cycles import TARGETS, target

FREE_RUN = 60.0  # s
WINDOW = 20.0  # s: its last part, which counts


def attractor_errors(body: Body, *, seed: int) -> dict[str, dict[str, float]]:
    """Orbit errors [task]["A_to_B"] of readouts taught under integrator A and run under B.

    Each run starts from clean teacher forcing under B; the error is that of the last WINDOW
    seconds of a free run. The twin agrees with MuJoCo to rounding and is some twenty times faster.
    """
    teaching, twinned = Teaching(), [row.name for row in INTEGRATORS.values() if row.twin]
    table: dict[str, dict[str, float]] = {}
    for name in TARGETS:
        goal = target(name)
        table[name] = {}
        for taught in twinned:
            teacher = Simulation(body, integrator=taught, engine="twin")
            fit = teach(teacher, goal, teaching, seed)
            for run in twinned:
                simulation = Simulation(body, integrator=run, engine="twin")
                synchronise(simulation, goal, teaching.washout)
                simulation.set_readout(fit.w_out)
                total, last = (round(s / simulation.timestep) for s in (FREE_RUN, WINDOW))
                outputs = simulation.rollout(total, record=("outputs",)).get("outputs")
                table[name][f"{taught}_to_{run}"] = orbit_error(outputs[-last:], goal)
    return table
