"""A run whose readout is corrected meanwhile, by recursive least squares in compiled code.

It has an MjModel and MjData of its own: the state moves there and, at the end, back, bit for bit.
The law, its sensors and all callbacks are those of any other run.
"""

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, NamedTuple

import mujoco
import numpy as np
from mujoco.batch import Batch

from mcmj.core.callbacks import install
from mcmj.core.callbacks.library import function_address
from mcmj.core.callbacks.online_learning import Learner, Machine, advance, write_weights
from mcmj.simulation.mujoco_engine import Engine
from mcmj.simulation.reservoir import Reservoir
from mcmj.simulation.simulation import Simulation
from mcmj.utils.errors import DivergenceError, InvalidArgumentError
from mcmj.utils.progress import OnSteps
from mcmj.utils.quiet import quiet_warnings
from mcmj.utils.validation import Array

_STATE = mujoco.mjtState.mjSTATE_INTEGRATION.value
_NOT_FINITE = slice(
    mujoco.mjtWarning.mjWARN_BADQPOS.value, mujoco.mjtWarning.mjWARN_BADCTRL.value + 1
)


class Stretch(NamedTuple):
    """What drives T steps, and what is to be learned in them.

    Attributes:
        targets: (n, n_outputs) what the outputs should be at steps 0, every, 2 every, ..
        offset: (T, n_outputs), added to the fed-back outputs.
        inputs: (T, n_inputs); None: no input.
    """

    targets: Array
    offset: Array
    inputs: Array | None = None


class _Layout(NamedTuple):
    """A simulation's model, and where in it readout and channels are.

    Attributes:
        batch: MuJoCo's, of one simulation.
        install: puts the callbacks in.
        outputs, inputs: actuators of the channels.
        signals, late, substeps: as in Machine.
    """

    batch: Batch
    install: Callable[[], None]
    outputs: slice
    inputs: slice
    signals: Any
    late: Any
    substeps: int


def run_corrected(
    simulation: Simulation | Reservoir,
    learner: Learner,
    stretches: Iterable[Stretch],
    *,
    every: int,
    gate: float = 1.0,
    on_steps: OnSteps = lambda steps: None,
) -> None:
    """Run one stretch after the other; the simulation then has the readout that was learned.

    After a blow-up the simulation is where it was, with the readout it had.

    Args:
        simulation: a body, or any reservoir.
        learner: of simulation's signals; it is changed.
        every: control steps between corrections, the first of each stretch at its first step.
        gate: 1: the outputs are fed back while they are learned; 0: the loop is open.
        on_steps: called with the number of steps done after every stretch.

    Raises:
        DivergenceError: the simulation blew up, or the readout did.
        InvalidArgumentError: the engine is the twin, or an ensemble.
    """
    layout = _layout(simulation)
    with simulation._only_drive():
        simulation.restore(simulation.snapshot())  # late signals are then part of the state
        snapshot = simulation.snapshot()
        model = layout.batch.get_model(0)
        model.actuator_biasprm[layout.outputs, 0] = gate
        data = _data_at(model, snapshot.ravel(), layout)
        machine = _machine(model, data, layout)
        write_weights(machine, learner)
        done = 0
        for stretch in stretches:
            layout.install()  # somebody may have taken it out meanwhile
            controls = _controls(model.nu, layout, stretch)
            time = data.time
            with quiet_warnings():
                steps = advance(machine, learner, controls, stretch.targets, every)
            if steps < len(controls):
                raise _divergence(simulation, time, done, steps)
            done += steps
            on_steps(steps)
        late = data.sensordata[layout.signals[layout.late]]
        simulation.restore(_moved(model, data, snapshot, done, late))
    signals = len(layout.signals)
    simulation.set_readout(model.actuator_user[layout.outputs, : signals + 1].T.copy())


def check_correctable(simulation: Simulation | Reservoir) -> None:
    """Raise unless `run_corrected` can run it.

    Raises:
        InvalidArgumentError: the engine is the twin, or an ensemble.
    """
    _layout(simulation)


def _layout(simulation: Simulation | Reservoir) -> _Layout:
    if isinstance(simulation, Reservoir):
        adopted, outputs = simulation._adopted, simulation._outputs_at
        return _Layout(
            batch=simulation._batch,
            install=install.install_control,
            outputs=outputs,
            inputs=slice(outputs.stop, outputs.stop + len(adopted.input_names)),
            signals=adopted.signals,
            late=adopted.late,
            substeps=1,
        )
    engine = simulation._engine
    if not isinstance(engine, Engine):
        raise InvalidArgumentError("engine", "'mujoco', to learn in closed loop", "'twin'")
    if engine.copies > 1:
        raise InvalidArgumentError("simulation", "a single one", f"{engine.copies} copies")
    body, end = engine.body, engine.model.nsensordata
    return _Layout(
        batch=engine._batch,
        install=partial(install.install, passive=engine._passive),
        outputs=slice(body.n_inputs, body.n_inputs + body.n_outputs),
        inputs=slice(0, body.n_inputs),
        signals=np.arange(end - body.n_springs, end),  # the last are never delayed or held
        late=np.zeros(body.n_springs, dtype=np.bool_),
        substeps=engine.substeps,
    )


def _data_at(model: mujoco.MjModel, snapshot: Array, layout: _Layout) -> mujoco.MjData:
    """Data at a snapshot, which begins with MuJoCo's state; then steps, late signals, a hash."""
    data, size = mujoco.MjData(model), mujoco.mj_stateSize(model, _STATE)
    mujoco.mj_setState(model, data, snapshot[:size], _STATE)
    data.ctrl[:] = 0.0
    data.qfrc_applied[:] = 0.0
    data.sensordata[layout.signals[layout.late]] = snapshot[size + 1 : -1]
    return data


def _moved(
    model: mujoco.MjModel, data: mujoco.MjData, snapshot: Array, steps: int, late: Array
) -> Array:
    """The snapshot so many steps later."""
    flat, size = snapshot.copy().ravel(), mujoco.mj_stateSize(model, _STATE)
    mujoco.mj_getState(model, data, flat[:size], _STATE)
    flat[size] += steps
    flat[size + 1 : -1] = late
    return flat.reshape(snapshot.shape)


def _machine(model: mujoco.MjModel, data: mujoco.MjData, layout: _Layout) -> Machine:
    first = min(layout.inputs.start, layout.outputs.start)
    return Machine(
        step=function_address("mj_step"),
        model=model._address,
        data=data._address,
        substeps=layout.substeps,
        ctrl=data.ctrl[first:],
        sensors=data.sensordata,
        speeds=data.qvel,
        warnings=data.warning.number[_NOT_FINITE],
        users=model.actuator_user[layout.outputs],
        signals=layout.signals,
        late=layout.late,
    )


def _controls(nu: int, layout: _Layout, stretch: Stretch) -> Array:
    """ctrl (T, n) of all channels, which are the last actuators."""
    first = min(layout.inputs.start, layout.outputs.start)
    controls = np.zeros((len(stretch.offset), nu))
    controls[:, layout.outputs] = stretch.offset
    if stretch.inputs is not None:
        controls[:, layout.inputs] = stretch.inputs
    return np.ascontiguousarray(controls[:, first:])


def _divergence(
    simulation: Simulation | Reservoir, time: float, before: int, steps: int
) -> DivergenceError:
    time += steps * simulation.timestep
    return DivergenceError(
        f"the simulation blew up after t = {time:.6g} s while it learned, step "
        f"{1e3 * simulation.timestep:g} ms; try a larger ridge, a smaller step, or smaller outputs",
        time=time,
        steps_done=before + steps,
    )
