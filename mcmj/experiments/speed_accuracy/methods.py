"""Integrators by name for the work-precision diagram: MuJoCo's, both spring paths, the twins."""

import warnings

from mcmj.core.body import Body
from mcmj.core.integrators import INTEGRATORS
from mcmj.core.rollout_arguments import check_drive
from mcmj.core.trajectory import State
from mcmj.reference.integration import integrate
from mcmj.reference.twin.population import Population
from mcmj.reference.twin.stepping import METHODS as TWINS
from mcmj.reference.twin.stepping import scheme_of
from mcmj.simulation.simulation import Simulation
from mcmj.utils.errors import StabilityWarning
from mcmj.utils.timing import Work
from mcmj.utils.validation import Array

# MuJoCo's explicit ones, also with the cubic law as a compiled callback
HOOKED = tuple(name for name, row in INTEGRATORS.items() if not (row.implicit or row.by_callback))
METHODS = (
    *(f"mujoco_{name}" for name in INTEGRATORS),
    *(f"mujoco_{name}_hook" for name in HOOKED),
    *(f"twin_{name}" for name in TWINS),
)
SHORT_STEP = 1e-5  # s: stable on every body, for timing


def final_state(
    body: Body, method: str, step_ms: float, steps: int, start: State, forces: Array
) -> State:
    """Where a body is after a number of steps under constant forces, loop open.

    Raises:
        DivergenceError: it blew up.
    """
    engine, name = method.split("_", 1)
    if engine == "twin":
        run = integrate(
            body,
            method=name,
            steps=steps,
            timestep=1e-3 * step_ms,
            forces=forces,
            initial_state=start,
        )
        assert run.final_state is not None
        return run.final_state
    simulation = _simulation(body, name, 1e-3 * step_ms)
    simulation.set_state(start.positions, start.velocities)
    simulation.rollout(steps, forces=forces, record=())
    return simulation.state


def adaptive(method: str) -> bool:
    """Whether the cost of a step depends on its length and on the motion."""
    engine, name = method.split("_", 1)
    return engine == "twin" and scheme_of(name, SHORT_STEP).adaptive


def stepping(body: Body, method: str, steps: int) -> Work:
    """Work of so many steps from rest, loop open, nothing recorded."""
    engine, name = method.split("_", 1)
    if engine == "mujoco":
        simulation = _simulation(body, name, SHORT_STEP)
        return lambda: simulation.rollout(steps, record=())
    population = Population([body], [None], method=name, timestep=SHORT_STEP)
    drive = check_drive(body, steps=steps, closed=False)
    return lambda: population.run(drive, 0, steps, lengths=False)


def moving(
    body: Body, method: str, step_ms: float, steps: int, start: State, forces: Array
) -> Work:
    """Work of a twin's steps from a start under constant forces, nothing recorded."""
    name = method.split("_", 1)[1]
    population = Population([body], [None], method=name, timestep=1e-3 * step_ms)
    drive = check_drive(body, steps=steps, forces=forces, closed=False)

    def work() -> None:
        population.set_states([start])
        population.run(drive, 0, steps, lengths=False)

    return work


def _simulation(body: Body, name: str, timestep: float) -> Simulation:
    springs = "cubic" if name.endswith("_hook") else "native"
    with warnings.catch_warnings():  # steps that are too long are what we look for
        warnings.simplefilter("ignore", StabilityWarning)
        return Simulation(
            body, integrator=name.removesuffix("_hook"), springs=springs, timestep=timestep
        )
