"""Free runs in closed loop: flat memory, checkpoints, errors in windows, trials."""

from collections.abc import Callable

import numpy as np

from mcmj.core.trajectory import Trajectory
from mcmj.learning.regression import Fit
from mcmj.metrics import orbits
from mcmj.simulation.reservoir import Reservoir
from mcmj.simulation.simulation import Simulation
from mcmj.targets.limit_cycles import Target
from mcmj.utils.checkpoint import Checkpoint
from mcmj.utils.errors import DivergenceError, InvalidArgumentError
from mcmj.utils.progress import OnSteps
from mcmj.utils.validation import Array, require_number

WINDOW = 50.0  # s
Failed = Callable[[Trajectory], bool]


def resume(simulation: Reservoir, checkpoint: Checkpoint) -> tuple[Array, Fit | None] | None:
    """Bring a simulation to where its checkpoint stands, if there is one.

    Returns:
        The outputs so far (T, n_outputs), and the fit if the readout was taught.

    Raises:
        CheckpointError: the checkpoint is damaged.
    """
    saved = checkpoint.load()
    if saved is None:
        return None
    arrays, outputs = saved
    simulation.set_readout(arrays["w_out"])
    simulation.restore(arrays["snapshot"])
    fit = arrays.get("fit")
    if fit is None:
        return outputs, None
    nrmse, rank, condition, rows = (float(value) for value in fit)
    return outputs, Fit(arrays["w_out"], nrmse, int(rank), condition, int(rows))


def free_run(
    simulation: Reservoir,
    steps: int,
    *,
    inputs: Array | None = None,
    done: Array | None = None,
    checkpoint: Checkpoint | None = None,
    fit: Fit | None = None,
    on_steps: OnSteps = lambda steps: None,
) -> Array:
    """Run free and keep only the outputs (steps, n_outputs); a checkpoint after every chunk.

    Args:
        inputs: (steps, n_inputs), default: none.
        done: outputs of the steps that are done already; the chunks are the same either way.
        fit: kept in the checkpoint.

    Raises:
        DivergenceError: the body blew up.
        InvalidArgumentError: the checkpoint does not hold what is done.
        OutputError: the disk does not take it.
    """
    outputs = np.empty((steps, simulation.n_outputs))
    at = 0 if done is None else len(done)
    if checkpoint is not None and checkpoint.rows != at:
        raise InvalidArgumentError("checkpoint", f"one that holds {at} rows", checkpoint.rows)
    if done is not None:
        outputs[:at] = done
    if at == steps:
        return outputs
    for part in simulation.stream(
        steps - at, None if inputs is None else inputs[at:], record=("outputs",)
    ):
        new = part.get("outputs")
        outputs[at : at + len(new)] = new
        if checkpoint is not None:
            checkpoint.save(_state(simulation, fit), new)
        at += len(new)
        on_steps(len(new))
    return outputs


def _state(simulation: Reservoir, fit: Fit | None) -> dict[str, Array]:
    w_out = simulation.w_out
    assert w_out is not None
    arrays = {"snapshot": simulation.snapshot(), "w_out": w_out}
    if fit is not None:
        numbers = [fit.train_nrmse, fit.rank, fit.condition_number, fit.rows]
        arrays["fit"] = np.array(numbers, dtype=np.float64)
    return arrays


def window_errors(
    outputs: Array, timestep: float, target: Target, *, length: float = WINDOW
) -> dict[str, object]:
    """Orbit and period errors of consecutive whole windows of a free run, and their drift.

    Returns:
        length [s]; orbit_errors and periods [s] of the windows (NaN: no rhythm);
        orbit_error_ratio, the last window's over the second's; period_drift,
        (T_last - T_second) / T*, both None with fewer than three windows; none of this if
        there is no whole window.
    """
    require_number("length", length, orbits.PERIODS_NEEDED * target.period)
    rows = round(length / timestep)
    windows = [outputs[k : k + rows] for k in range(0, len(outputs) - rows + 1, rows)]
    if not windows:
        return {}
    errors = [orbits.orbit_error(window, target) for window in windows]
    periods = [orbits.period_or_nan(window, timestep, target) for window in windows]
    enough = len(windows) > 2
    return {
        "length": length,
        "orbit_errors": errors,
        "periods": periods,
        "orbit_error_ratio": errors[-1] / errors[1] if enough else None,
        "period_drift": (periods[-1] - periods[1]) / target.period if enough else None,
    }


def trial_error(
    simulation: Reservoir,
    target: Target,
    duration: float,
    failed: Failed | None = None,
    *,
    on_steps: OnSteps = lambda steps: None,
) -> float:
    """Orbit error of the outputs in the last half of a free run; infinite if it fails.

    Args:
        duration: [s].
        failed: asked of every part of the run, whose outputs and qpos (of a body: positions) are
            recorded; a run that blows up has failed too.
        on_steps: called with the number of steps done after every part, for progress bars.
    """
    place = "positions" if isinstance(simulation, Simulation) else "qpos"
    record = ("outputs", place) if failed else ("outputs",)
    steps, kept, done = round(duration / simulation.timestep), [], 0
    try:
        for part in simulation.stream(steps, record=record):
            if failed is not None and failed(part):
                return np.inf
            done += len(part)
            if done > steps // 2:
                kept.append(part.get("outputs"))
            on_steps(len(part))
    except DivergenceError:
        return np.inf
    return orbits.orbit_error(np.concatenate(kept)[-(steps - steps // 2) :], target)
