"""Which engine runs a simulation: MuJoCo, or the compiled twin."""

from mcmj.body import Body
from mcmj.engine import Engine
from mcmj.errors import InvalidArgumentError
from mcmj.options import Options
from mcmj.twin.engine import TwinEngine


def make_engine(body: Body, options: Options, *, copies: int, threads: int) -> Engine | TwinEngine:
    """The engine that the options name.

    Raises:
        InvalidArgumentError: no Body.
    """
    if not isinstance(body, Body):
        raise InvalidArgumentError("body", "a Body", repr(body))
    kind = TwinEngine if options.engine == "twin" else Engine
    return kind(body, options, copies=copies, threads=threads)
