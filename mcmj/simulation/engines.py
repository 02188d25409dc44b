"""Which engine runs a simulation: MuJoCo, or the compiled twin."""

from mcmj.core.body import Body
from mcmj.core.options import Options
from mcmj.reference.twin.engine import TwinEngine
from mcmj.simulation.mujoco_engine import Engine
from mcmj.utils.errors import InvalidArgumentError


def make_engine(body: Body, options: Options, *, copies: int, threads: int) -> Engine | TwinEngine:
    """The engine that the options name.

    Raises:
        InvalidArgumentError: no Body.
    """
    if not isinstance(body, Body):
        raise InvalidArgumentError("body", "a Body", repr(body))
    kind = TwinEngine if options.engine == "twin" else Engine
    return kind(body, options, copies=copies, threads=threads)
