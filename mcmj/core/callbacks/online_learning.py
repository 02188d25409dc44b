"""Steps of a model whose readout is corrected meanwhile, in compiled code: recursive least squares.

    f = [(s - m) / d, 1],   e = y* - W^T f,   W <- W + P f e^T / (1 + f^T P f),
    P <- P - P f f^T P / (1 + f^T P f)

s are the signals at the start of a step, y* is what the outputs should be then; the weights are in
use from the next step on. So after n corrections W minimises sum |y* - W^T f|^2 + |P_0^(-1/2) (W -
W_0)|^2, as a batch would (Haykin, Adaptive Filter Theory).

P = R R^T is kept as its root R, which Potter's update corrects (Bierman, Factorization Methods for
Discrete Sequential Estimation, 1977, II.8):

    a = R^T f,   c = 1 + a^T a,   R <- R - R a a^T / (c + sqrt(c)),   P f = R a

P is then symmetric and never indefinite, and rounding acts on R, whose condition number is the
root of P's. The model's law reads the weights from the actuators' user data (see install.py,
reservoir_law.py), which take signals as they are:

    w_j = W_j / d_j,   bias = W_0 - sum_j w_j m_j
"""

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from mcmj.core.callbacks.pointers import call_step
from mcmj.utils.validation import Array

# NaN and infinity keep their meaning
COMPILE: dict[str, Any] = {
    "cache": True, "nogil": True, "fastmath": {"contract", "reassoc", "nsz", "arcp"},
}  # fmt: skip


class Machine(NamedTuple):
    """A model and its data, and views of their memory.

    Attributes:
        step, model, data: addresses of mj_step, mjModel and mjData.
        substeps: physics steps in a control step.
        ctrl: of all actuators.
        sensors: sensordata.
        speeds: qvel.
        warnings: how often MuJoCo warned of numbers that are not finite, by kind.
        users: user data of the outputs' actuators (n_outputs, >= n_signals + 1).
        signals: (n_signals,) where they stand in sensordata.
        late: (n_signals,) bool: heard as it was a step before.
    """

    step: int
    model: int
    data: int
    substeps: int
    ctrl: Array
    sensors: Array
    speeds: Array
    warnings: Any
    users: Array
    signals: Any
    late: Any


class Learner(NamedTuple):
    """What is learned, and how.

    Attributes:
        root: (n_signals + 1, n_signals + 1) R.
        weights: (n_outputs, n_signals + 1) W, the constant's last.
        mean, inverse_spread: (n_signals,) m and 1 / d; 0 leaves a signal out.
    """

    root: Array
    weights: Array
    mean: Array
    inverse_spread: Array


@njit(**COMPILE)
def advance(machine, learner, controls, targets, every):
    """Take control steps and correct the readout; the state is the machine's.

    Args:
        controls: (T, machine.ctrl.size) ctrl of every step, of all actuators.
        targets: (n, n_outputs) y*, one row for each correction.
        every: steps from one correction to the next; the first is at the first step.

    Returns:
        Number of steps done: less than T if the model blew up or the weights did.
    """
    signals, features = machine.signals.size, np.ones(machine.signals.size + 1)
    heard, projected = np.empty(signals), np.empty(signals + 1)
    gain = np.empty(signals + 1)
    for k in range(controls.shape[0]):
        machine.ctrl[:] = controls[k]
        for j in range(signals):
            heard[j] = machine.sensors[machine.signals[j]]
        for substep in range(machine.substeps):
            call_step(machine.step, machine.model, machine.data)
            if substep == 0:
                for j in range(signals):
                    if not machine.late[j]:
                        heard[j] = machine.sensors[machine.signals[j]]
            if blew_up(machine):
                return k
        if k % every == 0:
            for j in range(signals):
                features[j] = (heard[j] - learner.mean[j]) * learner.inverse_spread[j]
            correct(learner, features, targets[k // every], projected, gain)
            if not np.isfinite(learner.weights).all():
                return k
            write_weights(machine, learner)
    return controls.shape[0]


@njit(**COMPILE)
def blew_up(machine):
    """Whether MuJoCo met numbers that are not finite; it may have reset the state then."""
    return machine.warnings.any() or not np.isfinite(machine.speeds).all()


@njit(**COMPILE)
def correct(learner, features, target, projected, gain):
    """One step of recursive least squares; `projected` and `gain` are working space (n,)."""
    root, size = learner.root, features.size
    projected[:] = 0.0
    for i in range(size):
        for j in range(size):
            projected[j] += root[i, j] * features[i]
    share = 1.0
    for j in range(size):
        share += projected[j] * projected[j]
    shrink = 1.0 / (share + np.sqrt(share))
    for i in range(size):
        total = 0.0
        for j in range(size):
            total += root[i, j] * projected[j]
        gain[i] = total / share
        for j in range(size):
            root[i, j] -= shrink * total * projected[j]
    for c in range(target.size):
        error = target[c]
        for j in range(size):
            error -= learner.weights[c, j] * features[j]
        for j in range(size):
            learner.weights[c, j] += gain[j] * error


@njit(**COMPILE)
def write_weights(machine, learner):
    """Let the model's law have the weights."""
    signals = machine.signals.size
    for c in range(learner.weights.shape[0]):
        bias = learner.weights[c, signals]
        for j in range(signals):
            weight = learner.weights[c, j] * learner.inverse_spread[j]
            machine.users[c, j] = weight
            bias -= weight * learner.mean[j]
        machine.users[c, signals] = bias
