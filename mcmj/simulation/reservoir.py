"""Any MuJoCo model that computes: a readout of its sensors drives its actuators, inside the step.

    y(k) = W^T s(k) + b,    ctrl of an actuator = gain (gate_c y_c(k) + offset_c(k)) + inputs

s(k) are the sensors at the start of step k, also under RK4. What MuJoCo computes after actuation
only (forces, accelerations) is heard as it was one step before; `signals` show what was heard.
Inputs, offset, forces and the fed-back outputs are held over the step, also inside the stages
of RK4.
"""

import copy
from collections.abc import Sequence
from typing import Any, Self

import mujoco
import numpy as np
import numpy.typing as npt

from mcmj.simulation.batch_engine import BatchEngine
from mcmj.simulation.engines import Engine
from mcmj.simulation.loop import CHUNK as CHUNK
from mcmj.simulation.loop import Loop
from mcmj.simulation.model_engine import ModelEngine
from mcmj.simulation.models.adopt import Model, adopt, read_spec
from mcmj.simulation.models.damage import check_damage
from mcmj.simulation.models.names import Channels
from mcmj.simulation.models.reservoir_file import read_reservoir, write_reservoir
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, as_array


class Reservoir(Loop):
    """A MuJoCo model as a reservoir; its state carries over from one rollout to the next.

    Args:
        model: MJCF as a path or a string, an MjSpec or an MjModel; it is copied.
        sensors: names or glob patterns of sensors, in order; a vector gives one signal a
            component. What the model has no sensor for is asked for by kind and object:
            "jointpos:hip_*", "jointvel:*", "tendonpos:*", "actuatorfrc:*".
        channels: names or patterns of actuators, one output each; or the gains of the actuators
            that an output drives, {"y": {"left": 1.0, "right": -1.0}}.
        inputs: what inputs drive, the same way.
        w_out: readout (n_signals, n_channels), or with a bias as one row more.
        timestep: [s]; default: the model's.
        integrator: Euler, RK4, implicit, implicitfast, discrete; default: the model's; Euler for
            a body's file of leapfrog.
        feedback_delay: steps between a signal and the force it feeds back; the first that many
            outputs fed back are 0.
        copies: independent copies, each with its own state and, if given, readout, inputs and
            offset; all arrays then have the copies as their first axis.
        threads: that they run on; results do not depend on it.

    Raises:
        BodyFileError: no such file, or not a model.
        InvalidArgumentError, UnknownNameError: an argument out of bounds, an unknown name.
    """

    _alterations: tuple[tuple[Sequence[Any], Any], ...] = ()  # all that `alter` was given

    def __init__(
        self,
        model: Model,
        *,
        sensors: str | Sequence[str],
        channels: Channels,
        inputs: Channels = (),
        w_out: object = None,
        timestep: float | None = None,
        integrator: str | None = None,
        feedback_delay: int = 0,
        copies: int | None = None,
        threads: int = 1,
    ) -> None:
        self._adopted = adopt(
            read_spec(model, timestep, integrator),
            sensors,
            channels,
            inputs,
            feedback_delay,
            numbers=model if isinstance(model, mujoco.MjModel) else None,
        )
        engine = ModelEngine(self._adopted, copies=1 if copies is None else copies, threads=threads)
        self._begin(engine, w_out, copies)

    def with_copies(self, copies: int, threads: int = 1, *, lenient: bool = False) -> Self:
        """Independent copies of this reservoir at its start, cuts, masses and readout as they are.

        Args:
            lenient: copies that blow up are left behind, and `alive` says which; otherwise they
                are a DivergenceError. What is recorded of them after that means nothing.

        Raises:
            InvalidArgumentError: it has copies already, an argument out of bounds, or `lenient`
                with the compiled twin.
        """
        self._require_one()
        other = copy.copy(self)
        other._driven, other._alterations = False, ()
        other._begin(self._new_engine(copies, threads), self._w_out, copies)
        if lenient:
            other._engine.leave_behind()
        for cut, masses in self._alterations:
            other.alter(cut=cut, masses=masses)
        return other

    def _new_engine(self, copies: int, threads: int) -> Engine:
        return ModelEngine(self._adopted, copies=copies, threads=threads)

    @classmethod
    def open(cls, model: Model) -> Self:
        """A reservoir from its file, with its readout; see `to_mjcf`.

        Raises:
            BodyFileError: no such file, or not that of a reservoir.
        """
        spec, asked, w_out = read_reservoir(model)
        return cls(spec, **asked, w_out=w_out)

    def to_mjcf(self) -> str:
        """The model as MJCF, as it was altered, with sensors, channels and readout.

        Without mcmj it is the model with an open loop; MuJoCo's own viewer shows it. The readout
        is exact; the rest has the six digits that MuJoCo's writer keeps. Meshes and textures stay
        files of their own, named by their full paths.

        Raises:
            InvalidArgumentError: there are copies.
        """
        self._require_one()
        readout = None if self._w_out is None else self.readout
        return write_reservoir(self._adopted, readout, self._alterations)

    # --- what it is --------------------------------------------------------------------------

    @property
    def model(self) -> mujoco.MjModel:
        """MuJoCo's compiled model, as it was before `alter`; without readouts and gates.

        Raises:
            InvalidArgumentError: the engine is not MuJoCo.
        """
        return self._engine.model

    @property
    def signal_names(self) -> tuple[str, ...]:
        """Of the components of all sensors."""
        return self._adopted.signal_names

    @property
    def channel_names(self) -> tuple[str, ...]:
        """Of the outputs."""
        return self._adopted.channel_names

    @property
    def input_names(self) -> tuple[str, ...]:
        """Of the inputs."""
        return self._adopted.input_names

    @property
    def feedback_delay(self) -> int:
        """Steps between a signal and the force it feeds back."""
        return int(self._adopted.asked["feedback_delay"])

    @property
    def n_forces(self) -> int:
        """Number of forces: degrees of freedom."""
        return int(self.model.nv)

    @property
    def in_mujoco(self) -> BatchEngine:
        """MuJoCo's side: the batch, and where channels and signals are in its model.

        Raises:
            InvalidArgumentError: the engine is not MuJoCo, or there are copies.
        """
        if not isinstance(self._engine, BatchEngine):
            raise InvalidArgumentError("engine", "'mujoco', which has a model", "'twin'")
        self._require_one()
        return self._engine

    # --- state -------------------------------------------------------------------------------

    def restart(self, qpos: object = None, qvel: object = None, act: object = None) -> None:
        """Time 0 in a state of MuJoCo's own coordinates; None: as at the start.

        Args:
            qpos, qvel, act: (nq,), (nv,), (na,) for all copies, or (copies, ..) for each.

        Raises:
            InvalidArgumentError: wrong shape, NaN, or the engine is not MuJoCo.
        """
        sizes = {"qpos": self.model.nq, "qvel": self.model.nv, "act": self.model.na}
        arrays = {}
        for name, value in (("qpos", qpos), ("qvel", qvel), ("act", act)):
            if value is not None:
                each = self._copies is not None and np.asarray(value).ndim == 2
                lead = (self._copies,) if each else ()
                arrays[name] = as_array(name, value, (*lead, sizes[name]))
        self._engine.reset()
        for name, array in arrays.items():
            self._engine.bound(name)[:] = array

    def set_state(self, qpos: object = None, qvel: object = None) -> None:
        """Put the joints at positions (nq,) and velocities (nv,), MuJoCo's units.

        Raises:
            InvalidArgumentError: wrong shape, or NaN.
        """
        self._engine.set_state(qpos, qvel)

    @property
    def qpos(self) -> Array:
        """MuJoCo's joint positions now (nq,)."""
        return self._public(self._engine.bound("qpos").copy())

    @property
    def qvel(self) -> Array:
        """MuJoCo's joint velocities now (nv,)."""
        return self._public(self._engine.bound("qvel").copy())

    @property
    def act(self) -> Array:
        """Activations of MuJoCo's actuators now (na,)."""
        return self._public(self._engine.bound("act").copy())

    @property
    def alive(self) -> npt.NDArray[np.bool_]:
        """(copies,): which have not blown up since the start; all, unless `lenient`."""
        return self._engine.alive.copy()

    def check_alteration(self, cut: Sequence[Any], masses: Any) -> None:
        """Raise unless `alter` can do this.

        Raises:
            InvalidArgumentError, UnknownNameError: no such tendon or body, or a wrong mass.
        """
        check_damage(self.model, cut, masses)

    def alter(self, *, cut: Sequence[Any] = (), masses: Any = None) -> None:
        """Cut tendons by name and change masses [kg] of bodies, {name: mass}, for good.

        See mcmj.simulation.models.damage. Snapshots of before are then of another reservoir.

        Raises:
            InvalidArgumentError, UnknownNameError: no such tendon or body, or a wrong mass.
        """
        self.check_alteration(cut, masses)
        self._engine.alter(cut, masses)
        self._alterations += ((tuple(cut), copy.copy(masses)),)
        self.__dict__.pop("_fingerprint", None)

    # --- inside ------------------------------------------------------------------------------

    def _identity(self) -> bytes:
        binary = np.zeros(mujoco.mj_sizeModel(self.model), np.uint8)
        mujoco.mj_saveModel(self.model, None, binary)
        return binary.tobytes() + repr(self._alterations or "").encode()

    def _described(self) -> str:
        return "this model"
