"""A run whose readout is corrected meanwhile, by recursive least squares in compiled code.

It has an MjModel and MjData of its own: the state moves there and, at the end, back, bit for bit.
The law, its sensors and all callbacks are those of any other run.
"""

from collections.abc import Iterable
from typing import NamedTuple

import mujoco
import numpy as np

from mcmj.core.callbacks.offsets import function_address
from mcmj.core.callbacks.online_learning import Learner, Machine, advance, write_weights
from mcmj.simulation.batch_engine import BatchEngine
from mcmj.simulation.reservoir import Reservoir
from mcmj.utils.errors import DivergenceError
from mcmj.utils.progress import OnSteps
from mcmj.utils.quiet import untimed
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


def run_corrected(
    reservoir: Reservoir,
    learner: Learner,
    stretches: Iterable[Stretch],
    *,
    every: int,
    gate: float = 1.0,
    on_steps: OnSteps = lambda steps: None,
) -> None:
    """Run one stretch after the other; the reservoir then has the readout that was learned.

    After a blow-up the reservoir is where it was, with the readout it had.

    Args:
        learner: of the reservoir's signals; it is changed.
        every: control steps between corrections, the first of each stretch at its first step.
        gate: 1: the outputs are fed back while they are learned; 0: the loop is open.
        on_steps: called with the number of steps done after every stretch.

    Raises:
        DivergenceError: the simulation blew up, or the readout did.
        InvalidArgumentError: the engine is the twin, or there are copies.
    """
    engine = reservoir.in_mujoco
    outputs, done = engine.channels.outputs, 0
    with reservoir._only_drive():
        model = engine.batch.get_model(0)
        model.actuator_biasprm[outputs, 0] = gate
        data = _data_of(engine, model)
        machine = _machine(engine, model, data)
        write_weights(machine, learner)
        for stretch in stretches:
            engine.install()  # somebody may have taken callbacks out meanwhile
            controls, time = _controls(engine, stretch), data.time
            targets = np.ascontiguousarray(stretch.targets, np.float64)  # one kind is compiled
            with untimed():
                steps = advance(machine, learner, controls, targets, every)
            if steps < len(controls):
                raise _divergence(engine, time + steps * engine.timestep, done + steps)
            done += steps
            on_steps(steps)
        _put_back(engine, model, data, done)
    reservoir.set_readout(model.actuator_user[outputs, : reservoir.n_signals + 1].T.copy())


def _data_of(engine: BatchEngine, model: mujoco.MjModel) -> mujoco.MjData:
    """Data at the engine's state; its snapshot is what is kept, MuJoCo's state, steps done."""
    data, kept, snapshot = mujoco.MjData(model), engine.channels.kept, engine.snapshot()[0]
    mujoco.mj_setState(model, data, snapshot[len(kept) : -1], _STATE)
    data.sensordata[kept] = snapshot[: len(kept)]
    data.ctrl[:] = 0.0
    data.qfrc_applied[:] = 0.0
    data.xfrc_applied[:] = 0.0
    return data


def _put_back(engine: BatchEngine, model: mujoco.MjModel, data: mujoco.MjData, steps: int) -> None:
    """The engine goes on from the data, so many steps later."""
    kept = data.sensordata[engine.channels.kept]
    state = np.empty(mujoco.mj_stateSize(model, _STATE))
    mujoco.mj_getState(model, data, state, _STATE)
    engine.restore(np.concatenate([kept, state, [engine.steps_done + steps]])[None])


def _machine(engine: BatchEngine, model: mujoco.MjModel, data: mujoco.MjData) -> Machine:
    return Machine(
        step=function_address("mj_step"),
        model=model._address,
        data=data._address,
        substeps=engine.substeps,
        ctrl=data.ctrl,
        sensors=data.sensordata,
        speeds=data.qvel,
        warnings=data.warning.number[_NOT_FINITE],
        users=model.actuator_user[engine.channels.outputs],
        signals=engine.channels.signals,
        late=engine.channels.late,
    )


def _controls(engine: BatchEngine, stretch: Stretch) -> Array:
    """ctrl (T, nu) of every step."""
    controls = np.zeros((len(stretch.offset), engine.model.nu))
    controls[:, engine.channels.outputs] = stretch.offset
    if stretch.inputs is not None:
        controls[:, engine.channels.inputs] = stretch.inputs
    return controls


def _divergence(engine: BatchEngine, time: float, steps: int) -> DivergenceError:
    return DivergenceError(
        f"the simulation blew up after t = {time:.6g} s while it learned, step "
        f"{1e3 * engine.timestep:g} ms; try a larger ridge, a smaller step, or smaller outputs",
        time=time,
        steps_done=steps,
    )
