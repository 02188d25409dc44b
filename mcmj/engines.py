"""Which engine runs a simulation: MuJoCo, or the compiled twin."""

from mcmj.body import Body
from mcmj.engine import Engine
from mcmj.errors import InvalidArgumentError, UnknownNameError
from mcmj.spring_laws import NATIVE, SpringLaw
from mcmj.twin.engine import TwinEngine

ENGINES = ("mujoco", "twin")


def make_engine(
    name: str,
    body: Body,
    *,
    copies: int,
    threads: int,
    timestep: float,
    integrator: str,
    springs: str | SpringLaw,
    feedback_delay: int,
    substeps: int,
) -> Engine | TwinEngine:
    """The engine of a simulation; see Simulation for the arguments.

    Raises:
        UnknownNameError: no such engine.
        InvalidArgumentError: something that the twin does not do.
    """
    if name == "mujoco":
        return Engine(
            body,
            copies=copies,
            threads=threads,
            timestep=timestep,
            integrator=integrator,
            springs=springs,
            feedback_delay=feedback_delay,
            substeps=substeps,
        )
    if name != "twin":
        raise UnknownNameError("engine", name, ENGINES)
    for argument, value, only in (
        ("springs", springs, NATIVE),
        ("feedback_delay", feedback_delay, 0),
        ("substeps", substeps, 1),
    ):
        if value != only:
            raise InvalidArgumentError(argument, f"{only!r} with the twin", repr(value))
    return TwinEngine(
        body, copies=copies, threads=threads, timestep=timestep, integrator=integrator
    )
