"""What steps a reservoir: MuJoCo with a body or any model, or the compiled twin of a body."""

from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from mcmj.core.body import Body
from mcmj.core.options import Options
from mcmj.core.rollout_arguments import Drive
from mcmj.reference.twin.engine import TwinEngine
from mcmj.simulation.body_engine import BodyEngine
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array


class Engine(Protocol):
    """Steps copies of one system; arrays have the copies as their first axis.

    `recordable` names what `run` records.
    """

    recordable: tuple[str, ...]
    timestep: float

    @property
    def model(self) -> Any:
        """MuJoCo's compiled model."""

    @property
    def steps_done(self) -> int:
        """Control steps since the start."""

    @property
    def alive(self) -> npt.NDArray[np.bool_]:
        """(copies,) which have not blown up since the start."""

    def leave_behind(self) -> None:
        """From now on, copies that blow up are no errors; `alive` says which."""

    def reset(self) -> None:
        """Back to the start."""

    def set_readout(self, w_out: Array | None) -> None:
        """Readouts (rows, n_outputs) for all copies, or (copies, rows, n_outputs)."""

    def set_state(self, positions: object, velocities: object) -> None:
        """Positions and velocities, for all copies or each; None: as they are."""

    def snapshot(self) -> Array:
        """Full state (copies, n)."""

    def restore(self, snapshot: Array) -> None:
        """Continue from a snapshot, bit for bit."""

    def current_signals(self) -> Array:
        """Signals (copies, n_signals) now."""

    def bound(self, name: str) -> Array:
        """A field (copies, n) of MuJoCo's data."""

    def alter(self, cut: Any, masses: Any) -> None:
        """Cut springs and change masses, for good."""

    def pushes(self, forces: Any) -> Array:
        """Forces on bodies by name as (copies, n_bodies, 6)."""

    def prepare(self, drive: Drive) -> None:
        """Before the first chunk of a drive."""

    def run(self, drive: Drive, record: tuple[str, ...], start: int, stop: int) -> dict[str, Array]:
        """Control steps start .. stop - 1 of a drive; returns the recorded arrays."""


def make_engine(
    body: Body, options: Options, *, copies: int, threads: int
) -> BodyEngine | TwinEngine:
    """The engine that the options name.

    Raises:
        InvalidArgumentError: no Body.
    """
    if not isinstance(body, Body):
        raise InvalidArgumentError("body", "a Body", repr(body))
    kind = TwinEngine if options.engine == "twin" else BodyEngine
    return kind(body, options, copies=copies, threads=threads)
