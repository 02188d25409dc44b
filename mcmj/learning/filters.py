"""Filter tasks for any reservoir: it is driven by the input alone, and a linear readout is fitted.

The readout is fitted on one stretch and its nrmse_std taken on another. The baselines are linear
regressions on the input: of the moment, and with delays. What the reservoir does better than the
second is nonlinear; what it does better than the first is that, or memory (a plain delay is no
feat beside the second).
"""

from dataclasses import dataclass

from mcmj.learning.regression import fit_readout
from mcmj.metrics import orbits
from mcmj.simulation.held_symbols import Driven, held_states
from mcmj.simulation.reservoir import Reservoir
from mcmj.targets.filter_tasks import FilterTask, delays
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array


@dataclass(frozen=True)
class FilterResult:
    """One task.

    Attributes:
        task: what was asked.
        errors: on held-out data, nrmse_std of the reservoir, baseline_nrmse_std of regression on
            the input and its delays, input_only_nrmse_std of that on the input alone.
        outputs, wanted: (M, n_outputs) the reservoir's and the target's held-out values.
    """

    task: FilterTask
    errors: dict[str, float]
    outputs: Array
    wanted: Array


def learn_filter(
    reservoir: Reservoir,
    task: FilterTask,
    train: slice,
    test: slice,
    *,
    hold: int = 1,
    gain: float = 1.0,
    driven: Driven = "inputs",
    taps: int = 30,
) -> FilterResult:
    """Drive a reservoir through a task from where it is, feedback open, and fit a readout.

    Args:
        reservoir: without copies.
        train, test: symbols to fit on and to test on.
        hold: control steps that a symbol is shown for.
        gain: value of the input, or of the offset, per unit of the task's.
        driven: the inputs, or the offset of the output channels of a reservoir without.
        taps: see `fit_filter`.

    Raises:
        DivergenceError: it blew up.
        InvalidArgumentError: copies, or as many inputs as the task does not have.
    """
    if reservoir.copies is not None:
        raise InvalidArgumentError("reservoir", "one without copies", reservoir.copies)
    start = reservoir.signals
    states = held_states(reservoir, gain * task.inputs, hold, driven=driven, gate=0.0)
    return fit_filter(task, states - start, train, test, taps)


def fit_filter(
    task: FilterTask, states: Array, train: slice, test: slice, taps: int
) -> FilterResult:
    """Fit readouts of the states and of the baselines, and test them.

    Args:
        states: (M, n_signals), one row a symbol.
        train, test: symbols to fit on and to test on.
        taps: delays of the input that the baseline has, the present among them.
    """
    lags = delays(task.inputs, taps, task.tap_spacing)
    wanted = task.targets[test]
    outputs = {
        name: _run_readout(x, task.targets, train, test)
        for name, x in (("", states), ("baseline_", lags), ("input_only_", task.inputs))
    }
    errors = {f"{name}nrmse_std": orbits.nrmse_std(y, wanted) for name, y in outputs.items()}
    return FilterResult(task, errors, outputs[""], wanted)


def _run_readout(x: Array, y: Array, train: slice, test: slice) -> Array:
    """Outputs on the test part of a readout with a bias, fitted on the other."""
    w_out = fit_readout(x[train], y[train], bias=True)
    found: Array = x[test] @ w_out[:-1] + w_out[-1]
    return found
