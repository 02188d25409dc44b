"""A body in MuJoCo: its model, and its nodes and springs in MuJoCo's numbers."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mcmj.core.body import Body
from mcmj.core.callbacks.leapfrog import node_velocities, userdata_size
from mcmj.core.callbacks.spring_laws import spring_law
from mcmj.core.integrators import integrator_named
from mcmj.core.options import Options
from mcmj.core.rollout_arguments import Drive
from mcmj.core.trajectory import State
from mcmj.mjcf.body_model import body_model, has_tendons
from mcmj.mjcf.without_tendons import cut_springs
from mcmj.simulation.batch_engine import BatchEngine, Channels, shifted
from mcmj.simulation.damage import cut_tendons, set_masses
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, as_array


class BodyEngine(BatchEngine):
    """MuJoCo's side of a simulation of a body; see Simulation for the options."""

    recordable: tuple[str, ...] = ("signals", "positions", "velocities")

    def __init__(self, body: Body, options: Options, *, copies: int, threads: int) -> None:
        self.body, self.options = body, options
        timestep, integrator, substeps = options.timestep, options.integrator, options.substeps
        self.advice = (
            f"try a smaller step (substeps={2 * substeps}) or another integrator ('discrete' "
            "survives stiff dampers), or smaller forces and readout weights"
        )
        self._physics_step = options.physics_step
        self._by_callback = integrator_named(integrator).by_callback
        self._tendons = has_tendons(options)
        own = not self._tendons
        self._passive = own or spring_law(options.springs) is not None or self._by_callback
        self._sensors = own
        self.install()  # first: MuJoCo's compiler calls them too
        model = body_model(body, options)
        self._memory = slice(0, userdata_size(model.nv) if self._by_callback else 0)
        # joints are n<i>x, n<i>y (, n<i>z) in node order
        first = body.dimensions * np.arange(len(body.free))
        channels = Channels(
            inputs=slice(0, body.n_inputs),
            outputs=slice(body.n_inputs, model.nu),
            forces=body.free,
            pushed=[(first + i, share) for i, share in enumerate(body.direction) if share],
            # the last L sensors are never delayed or held
            signals=np.arange(model.nsensordata - body.n_springs, model.nsensordata),
            late=np.zeros(body.n_springs, dtype=np.bool_),
            kept=np.zeros(0, dtype=np.int64),
        )
        super().__init__(
            model, channels, timestep=timestep, substeps=substeps, copies=copies, threads=threads
        )

    def alter(self, cut: Sequence[int], masses: Array | None) -> None:
        """Cut springs and change masses (N,) [kg] of all copies, for good."""
        self.install()
        if self._tendons:
            cut_tendons(self.batch, list(cut))
        else:
            cut_springs(self.batch.expand("numeric_data"), self.body, list(cut))
        if masses is not None:
            set_masses(self.batch, self.body, masses)

    def pushes(self, forces: object) -> Array:
        """Forces by name are for models.

        Raises:
            InvalidArgumentError: always.
        """
        raise InvalidArgumentError("forces", "(N,) or (T, N) on a body's nodes", "names")

    def start_anew(self, data: Any) -> None:
        """Before the velocities of a state are changed: the leapfrog begins again from it."""
        data.qvel[:] = self._after_step(data.qvel, data.userdata)
        data.userdata[self._memory] = 0.0

    # --- state -------------------------------------------------------------------------------

    @property
    def state(self) -> State:
        """Positions and velocities (copies, N, D) now."""
        return State(
            positions=self._positions(self.bound("qpos")),
            velocities=self._velocities(self._joint_velocities()),
            time=self.steps_done * self.timestep,
        )

    def set_state(self, positions: object, velocities: object) -> None:
        """Positions and velocities (N, D) for all copies, or (copies, N, D); None: as they are."""
        free, shape = self.body.free, self.body.positions.shape
        if self._by_callback:  # starts anew
            self.bound("qvel")[:] = self._joint_velocities()
            self.bound("userdata")[:, self._memory] = 0.0
        for name, value, field, origin in (
            ("positions", positions, "qpos", self.body.positions),
            ("velocities", velocities, "qvel", 0.0),
        ):
            if value is not None:
                lead = (self.copies,) if np.asarray(value).ndim == 3 else ()
                array = as_array(name, value, (*lead, *shape)) - origin
                self.bound(field)[:] = array[..., free, :].reshape(*lead, -1)

    def current_signals(self) -> Array:
        """Spring lengths (copies, L) [m] at the current state."""
        found: Array = self.sensors_now()[:, -self.body.n_springs :].copy()
        return found

    def _positions(self, qpos: Array) -> Array:
        """Node positions (..., N, D) from joint positions (..., nq)."""
        shape = self.body.positions.shape
        positions = np.empty((*qpos.shape[:-1], *shape))
        positions[:] = self.body.positions
        positions[..., self.body.free, :] += qpos.reshape(*qpos.shape[:-1], -1, shape[1])
        return positions

    def _joint_velocities(self) -> Array:
        """Best estimates (copies, nv) of the velocities now [m/s]."""
        return self._after_step(self.bound("qvel"), self.bound("userdata"))

    def _after_step(self, qvel: Array, userdata: Array) -> Array:
        """The same, from arrays (..., nv) and (..., nuserdata) after a step."""
        return node_velocities(qvel, userdata[..., self._memory], self._physics_step)

    def _velocities(self, qvel: Array) -> Array:
        """Node velocities (..., N, D) from joint velocities (..., nv)."""
        shape = self.body.positions.shape
        velocities = np.zeros((*qvel.shape[:-1], *shape))
        velocities[..., self.body.free, :] = qvel.reshape(*qvel.shape[:-1], -1, shape[1])
        return velocities

    # --- stepping ----------------------------------------------------------------------------

    def run(self, drive: Drive, record: tuple[str, ...], start: int, stop: int) -> dict[str, Array]:
        """Control steps start .. stop - 1 of a drive; returns the recorded arrays.

        Raises:
            DivergenceError: a copy blew up.
            McmjError: another package's callback is installed.
        """
        qpos, qvel = self.bound("qpos").copy(), self._joint_velocities().copy()
        items = {"positions": "qpos", "velocities": "qvel", "signals": "sensordata"}
        wanted = [items[name] for name in record]
        if "velocities" in record:
            wanted.append("userdata")
        rows = self._advance(drive, start, stop, wanted)
        recorded = {}
        for name in record:
            samples = rows[items[name]]
            if name == "signals":  # sensors show the start of the step, the state its end
                # the last L sensors are never delayed or held
                recorded[name] = samples[:, :: self.substeps, -self.body.n_springs :]
            elif name == "positions":
                recorded[name] = self._positions(shifted(qpos, samples, self.substeps))
            else:
                after = self._after_step(samples, rows["userdata"])
                recorded[name] = self._velocities(shifted(qvel, after, self.substeps))
        return recorded

    def _fastest(self, copy: int) -> str:
        velocities = self._velocities(self.bound("qvel")[copy])
        with np.errstate(over="ignore"):
            speed = np.hypot.reduce(np.nan_to_num(velocities, nan=np.inf), axis=1)
        node = int(speed.argmax())
        return f"node {node} (speed {speed[node]:.3g} m/s), integrator {self.options.integrator}"
