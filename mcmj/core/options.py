"""How a simulation is stepped, checked once for every engine."""

from dataclasses import dataclass

from mcmj.core.callbacks.spring_laws import NATIVE, SpringLaw
from mcmj.core.integrators import DEFAULT_INTEGRATOR, INTEGRATORS, TWINNED, integrator_named
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.validation import require_count, require_timestep

TENDONS = "tendons"  # MuJoCo, with the tendons of the body's file
ENGINES = ("mujoco", TENDONS, "twin")


@dataclass(frozen=True)
class Options:
    """Arguments of a Simulation that are not the body's; see there.

    Raises:
        InvalidArgumentError, UnknownNameError: out of bounds, or not done by the engine.
    """

    timestep: float = 1e-3
    integrator: str = DEFAULT_INTEGRATOR
    springs: str | SpringLaw = NATIVE
    feedback_delay: int = 0
    substeps: int = 1
    engine: str = "mujoco"

    def __post_init__(self) -> None:
        require_timestep("timestep", self.timestep)
        require_count("feedback_delay", self.feedback_delay, 0)
        require_count("substeps", self.substeps, 1)
        if self.engine not in ENGINES:
            raise UnknownNameError("engine", self.engine, ENGINES)
        if self.engine == "twin":
            self._check_twin()
        elif self.integrator in TWINNED and self.integrator not in INTEGRATORS:
            raise InvalidArgumentError("engine", f"'twin' for {self.integrator}", self.engine)
        elif integrator_named(self.integrator).stages > 1 and self.feedback_delay:
            raise InvalidArgumentError(
                "feedback_delay",
                f"0 under {self.integrator}, whose inner stages MuJoCo's delayed sensors keep",
                self.feedback_delay,
            )

    @property
    def physics_step(self) -> float:
        """Of the integrator [s]."""
        return self.timestep / self.substeps

    def _check_twin(self) -> None:
        integrator_named(self.integrator, TWINNED, "integrator of the twin")
        for name, only in (("springs", NATIVE), ("feedback_delay", 0), ("substeps", 1)):
            value = getattr(self, name)
            if value != only:
                raise InvalidArgumentError(name, f"{only!r} with the twin", repr(value))
