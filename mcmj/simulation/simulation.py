"""A body as a reservoir: its springs' lengths are the signals, its channels push its nodes."""

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import ClassVar, cast

from mcmj.core.body import Body
from mcmj.core.callbacks.spring_laws import SpringLaw
from mcmj.core.integrators import DEFAULT_INTEGRATOR
from mcmj.core.options import TENDONS, Options
from mcmj.core.trajectory import State
from mcmj.mjcf.write import to_mjcf
from mcmj.reference.twin.engine import TwinEngine
from mcmj.simulation.body_engine import BodyEngine
from mcmj.simulation.damage import checked_cut, checked_masses
from mcmj.simulation.engines import make_engine
from mcmj.simulation.reservoir import CHUNK as CHUNK
from mcmj.simulation.reservoir import Reservoir
from mcmj.simulation.stepsize.limit import warn_if_unstable
from mcmj.utils.errors import InvalidArgumentError


class Simulation(Reservoir):
    """A body; its state carries over from one rollout to the next.

    A Reservoir whose signals are the lengths (L,) [m] of the springs, and whose `forces` (N,) or
    (T, N) act on the nodes along the body's direction [N]. It records "lengths", which are its
    signals, "outputs", "positions" and "velocities".

    Args:
        body: the body.
        w_out: readout (L, n_outputs), or (L + 1, n_outputs) with a bias in the last row; a pair
            of weights and bias, or a Readout.
        timestep: control step [s]: inputs, feedback and records go at this pace.
        integrator: leapfrog, of second order at Euler's cost (mcmj.core.callbacks.leapfrog); or
            one of MuJoCo's: Euler, RK4, implicit, implicitfast, discrete.
        springs: "native" (MuJoCo's polynomial), "cubic" or "tansig" (compiled callback), or
            your own SpringLaw.
        feedback_delay: number of control steps between a length and the force it feeds back;
            the first that many outputs fed back are 0.
        substeps: physics steps in a control step.
        engine: "mujoco", whose springs are mcmj's compiled callbacks, but for the integrators that
            need their derivatives; "tendons": MuJoCo's own tendons always, as in the body's file,
            the same to rounding at twice the time; or "twin" for the compiled twin (Euler, RK4,
            leapfrog; native springs, no delay, no substeps, no positions recorded), some
            twenty times faster, for screening.

    Raises:
        InvalidArgumentError, UnknownNameError: an argument out of bounds.
    """

    _aliases: ClassVar[dict[str, str]] = {"signals": "lengths"}

    def __init__(
        self,
        body: Body,
        *,
        w_out: object = None,
        timestep: float = 1e-3,
        integrator: str = DEFAULT_INTEGRATOR,
        springs: str | SpringLaw = "native",
        feedback_delay: int = 0,
        substeps: int = 1,
        engine: str = "mujoco",
    ) -> None:
        options = Options(timestep, integrator, springs, feedback_delay, substeps, engine)
        self._begin_body(body, options, w_out)

    def _begin_body(
        self,
        body: Body,
        options: Options,
        w_out: object,
        copies: int | None = None,
        threads: int = 1,
    ) -> None:
        one_engine = make_engine(
            body, options, copies=1 if copies is None else copies, threads=threads
        )
        warn_if_unstable(body, options)
        self._begin(one_engine, w_out, copies)

    def _new_engine(self, copies: int, threads: int) -> BodyEngine | TwinEngine:
        return make_engine(self.body, self.options, copies=copies, threads=threads)

    @property
    def _body_engine(self) -> BodyEngine | TwinEngine:
        return cast(BodyEngine | TwinEngine, self._engine)

    @property
    def options(self) -> Options:
        """How it is stepped: time step, integrator, springs, delay, substeps, engine."""
        return self._body_engine.options

    @property
    def body(self) -> Body:
        """The body that is simulated."""
        return self._body_engine.body

    @property
    def signal_names(self) -> tuple[str, ...]:
        """Of the springs, as in the body's file."""
        return tuple(f"length{j}" for j in range(self.body.n_springs))

    @property
    def channel_names(self) -> tuple[str, ...]:
        """Of the feedback channels, as in the body's file."""
        return tuple(f"fb{c}" for c in range(self.body.n_outputs))

    @property
    def input_names(self) -> tuple[str, ...]:
        """Of the input channels, as in the body's file."""
        return tuple(f"in{c}" for c in range(self.body.n_inputs))

    @property
    def feedback_delay(self) -> int:
        """Steps between a length and the force it feeds back."""
        return self.options.feedback_delay

    @property
    def n_signals(self) -> int:
        """L."""
        return self.body.n_springs

    @property
    def n_forces(self) -> int:
        """N."""
        return self.body.n_forces

    def to_mjcf(self) -> str:
        """The body as MJCF with its readout, to the last bit; see mcmj.to_mjcf.

        Raises:
            InvalidArgumentError: it was altered, which no body file says; or there are copies.
        """
        self._require_one()
        if self._alterations:
            raise InvalidArgumentError("simulation", "one that was not altered", "cuts or masses")
        return to_mjcf(
            self.body,
            timestep=self.options.physics_step,
            integrator=self.options.integrator,
            w_out=self.w_out,
        )

    def with_tendons(self) -> "Simulation":
        """The same at its start, with cuts and masses, in a model whose tendons MuJoCo draws.

        Raises:
            InvalidArgumentError: the engine is the twin, or there are copies.
        """
        self.in_mujoco.install()
        options = replace(self.options, engine=TENDONS)
        names = [field.name for field in fields(options)]
        stepping = {name: getattr(options, name) for name in names}
        other = Simulation(self.body, w_out=self.w_out, **stepping)
        for cut, masses in self._alterations:
            other.alter(cut=cut, masses=masses)
        return other

    def check_alteration(self, cut: Sequence[int], masses: object) -> None:
        """Raise unless `alter` can do this.

        Raises:
            InvalidArgumentError: no such spring, a wrong mass, or the engine is the twin.
        """
        checked_cut(self.body, cut)
        if masses is not None:
            checked_masses(self.body, masses)
        if (cut or masses is not None) and not isinstance(self._body_engine, BodyEngine):
            raise InvalidArgumentError("engine", "'mujoco' for bodies that change", "'twin'")

    def alter(self, *, cut: Sequence[int] = (), masses: object = None) -> None:
        """Cut springs and change masses (N,) [kg], for good; `body` stays what it was.

        Raises:
            InvalidArgumentError: no such spring, a wrong mass, or the engine is the twin.
        """
        self.check_alteration(cut, masses)
        weights = None if masses is None else checked_masses(self.body, masses)
        self._engine.alter(checked_cut(self.body, cut), weights)
        self._alterations += ((tuple(cut), weights),)
        self.__dict__.pop("_fingerprint", None)

    @property
    def state(self) -> State:
        """Positions, velocities and time now."""
        state = self._body_engine.state
        return replace(
            state,
            positions=self._public(state.positions),
            velocities=self._public(state.velocities),
        )

    def set_state(self, positions: object = None, velocities: object = None) -> None:
        """Put the nodes at positions and velocities (N, D) [m], [m/s]; fixed nodes stay.

        Raises:
            InvalidArgumentError: wrong shape, or NaN.
        """
        self._engine.set_state(positions, velocities)

    # --- inside ------------------------------------------------------------------------------

    def _identity(self) -> bytes:
        """Of the body's arrays and the settings."""
        name = getattr(self.options.springs, "name", self.options.springs)
        parts = [repr(replace(self.options, springs=name)).encode()]
        for field in fields(self.body):
            if field.name == "direction" and self.body.pushed_along_x:
                continue  # snapshots are those of bodies before they had one
            array = getattr(self.body, field.name)
            parts.append(repr(array.shape).encode() + array.tobytes())
        for cut, masses in self._alterations:
            parts.append(repr(cut).encode() + (b"" if masses is None else masses.tobytes()))
        return b"".join(parts)

    def _described(self) -> str:
        return f"{self.body!r} and these settings: {self.options}"

    def _final_state(self) -> State:
        return self.state
