"""The integrators, one row each: every other list of their names is derived from this table.

A new integrator is a row here and its stepping: MuJoCo's own, or what mcmj's passive force
callback makes of one of MuJoCo's (`leapfrog`); in the twin, if it has one (`twin.kernels`);
and its linearised step (`onestep`), from which its stability limit follows.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from mcmj.utils.errors import UnknownNameError


@dataclass(frozen=True)
class Integrator:
    """How a step is taken.

    Attributes:
        name: in mcmj.
        mujoco_name: of the integrator that MuJoCo runs; empty if only the twin takes such steps.
        twin: the compiled twin's method; empty without one.
        order: of accuracy in the step, for forces that are smooth.
        implicit: solves for the springs' forces at the end of the step, by their derivatives.
        stages: evaluations of the forces in a step.
        damping_factor: r, where q_k = (-1)^k u is stable if h^2 K u + r h D u < 4 M u, but for
            what an implicit integrator solves for (see `onestep`).
        grace: share of a step for which a step may be too long for the motion; see `along_motion`.
        advised: accurate enough to be named as a way out of a step that is too long.
    """

    name: str
    mujoco_name: str
    twin: str = ""
    order: int = 1
    implicit: bool = False
    stages: int = 1
    damping_factor: float = 2.0
    grace: float = 0.35
    advised: bool = True

    @property
    def by_callback(self) -> bool:
        """Whether it is MuJoCo's only with mcmj's passive force callback, which has a memory."""
        return self.name != self.mujoco_name


_ROWS = (
    Integrator("Euler", "Euler", twin="semi_implicit_euler"),
    Integrator("RK4", "RK4", twin="rk4", order=4, stages=4, grace=0.22),
    Integrator("implicit", "implicit", implicit=True, advised=False),
    Integrator("implicitfast", "implicitfast", implicit=True, advised=False),
    Integrator("discrete", "discrete", implicit=True),
    Integrator("leapfrog", "Euler", twin="leapfrog", order=2, damping_factor=4.0, grace=1.1),
    Integrator("adaptive_leapfrog", "", twin="adaptive_leapfrog", order=2, damping_factor=4.0),
)
INTEGRATORS = {row.name: row for row in _ROWS if row.mujoco_name}
TWINS = {row.twin: row for row in _ROWS if row.twin}
TWINNED = {row.name: row for row in TWINS.values()}
DEFAULT_INTEGRATOR = "leapfrog"


def integrator_named(
    name: str, choices: Mapping[str, Integrator] = INTEGRATORS, kind: str = "integrator"
) -> Integrator:
    """The integrator of a name, among these.

    Raises:
        UnknownNameError: no such name; says the valid ones of this kind.
    """
    if name not in choices:
        raise UnknownNameError(kind, name, choices)
    return choices[name]
