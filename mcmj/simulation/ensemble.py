"""Copies of one body on several threads: many readouts, inputs or kicks in one rollout."""

from mcmj.core.body import Body
from mcmj.core.callbacks.spring_laws import SpringLaw
from mcmj.core.integrators import DEFAULT_INTEGRATOR
from mcmj.core.options import Options
from mcmj.simulation.simulation import Simulation


class Ensemble(Simulation):
    """Copies of one body, each with its own readout, inputs and state, on several threads.

    Like a Simulation, but every recorded array has the copies as its first axis, and
    `w_out`, `inputs`, `offset`, `forces` (with a time axis), positions and velocities may
    have it too; without it they are the same for all. Results do not depend on `threads`.

    Args:
        body, timestep, integrator, springs, feedback_delay, substeps, engine: as for Simulation.
        copies: number of simulations.
        threads: number of threads.
        w_out: readout for all, or (copies, rows, n_outputs).
    """

    def __init__(
        self,
        body: Body,
        *,
        copies: int,
        threads: int = 1,
        w_out: object = None,
        timestep: float = 1e-3,
        integrator: str = DEFAULT_INTEGRATOR,
        springs: str | SpringLaw = "native",
        feedback_delay: int = 0,
        substeps: int = 1,
        engine: str = "mujoco",
    ) -> None:
        options = Options(timestep, integrator, springs, feedback_delay, substeps, engine)
        self._begin_body(body, options, w_out, copies, threads)
