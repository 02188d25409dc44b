"""The same questions put to MuJoCo: samples of what the twin computed."""

import numpy as np

from mcmj.analysis.stability.basin import judge, pushed, survey
from mcmj.analysis.stability.cycle import Cycle, weights_at
from mcmj.analysis.stability.floquet import Floquet
from mcmj.analysis.stability.loop import INTEGRATOR, ClosedLoop, require_planar
from mcmj.analysis.stability.tolerance import Trial
from mcmj.simulation.ensemble import Ensemble
from mcmj.targets.limit_cycles import Target
from mcmj.utils.errors import DivergenceError
from mcmj.utils.validation import Array

EPS = 1e-4  # width of the differences, m and m/s


def ensemble_map(loop: ClosedLoop, states: Array, duration: float) -> Array:
    """`cycle.flow_map` in MuJoCo: states (B, n) after a duration [s].

    Raises:
        DivergenceError: a copy blew up.
    """
    steps = int(duration / loop.timestep)
    ensemble = _ensemble(loop, states)
    rows = []
    for count in (steps - 1, 1, 1, 1):
        ensemble.rollout(count, record=())
        rows.append(_vectors(ensemble, loop))
    return np.tensordot(weights_at(duration / loop.timestep - steps), np.stack(rows), axes=1)


def directional(
    loop: ClosedLoop, state: Array, directions: Array, duration: float, eps: float
) -> Array:
    """D phi_T d (k, n) for directions d (k, n), by central differences of width eps in MuJoCo."""
    ends = ensemble_map(
        loop, np.concatenate([state + eps * directions, state - eps * directions]), duration
    )
    return (ends[: len(directions)] - ends[len(directions) :]) / (2 * eps)


def monodromy_error(loop: ClosedLoop, cycle: Cycle, analysis: Floquet) -> float:
    """Of the phase's and the leading direction d in MuJoCo: largest |D d - M d| / |d|."""
    leading = analysis.leading_vector.real / np.linalg.norm(analysis.leading_vector.real)
    unit = np.stack([cycle.tangent / np.linalg.norm(cycle.tangent), leading])
    moved = directional(loop, cycle.state, unit, cycle.period, EPS)
    return float(np.linalg.norm(moved - unit @ analysis.monodromy.T, axis=1).max())


def verdicts(
    loop: ClosedLoop,
    target: Target,
    states: Array,
    forces: Array,
    trial: Trial,
) -> tuple[int, int]:
    """Pushes that MuJoCo judges as the twin does, and how many were compared.

    Copies (B, n) are pushed by constant forces (B, N) [N], without refined
    steps; compared are those that the twin survives. None agrees if MuJoCo blows up in one.
    """
    after = pushed(loop, states, forces, trial.hold)
    twin = survey(loop, target, after, duration=trial.recovery, threshold=trial.threshold)
    alive = np.flatnonzero(~twin.blown)
    if not alive.size:
        return 0, 0
    ensemble = _ensemble(loop, states[alive])
    rows = np.repeat(forces[alive, None], round(trial.hold / loop.timestep), axis=1)
    try:
        ensemble.rollout(forces=rows, record=())
        free = ensemble.rollout(round(trial.recovery / loop.timestep), record=("outputs",))
    except DivergenceError:
        return 0, len(alive)
    judged = judge(
        free.get("outputs"), np.ones(len(alive), np.bool_), loop.timestep, target,
        2 * target.period, trial.threshold,
    )  # fmt: skip
    return int((judged.recovered == twin.recovered[alive]).sum()), len(alive)


def _ensemble(loop: ClosedLoop, states: Array) -> Ensemble:
    require_planar(loop, "have a twin to be confirmed; a ReservoirLoop runs in MuJoCo itself")
    ensemble = Ensemble(
        loop.body, copies=len(states), threads=loop.threads, w_out=loop.w_out,
        timestep=loop.timestep, integrator=INTEGRATOR,
    )  # fmt: skip
    ensemble.set_state(*loop.nodes(states))
    return ensemble


def _vectors(ensemble: Ensemble, loop: ClosedLoop) -> Array:
    now, free = ensemble.state, loop.body.free
    moving = np.stack([now.positions[:, free], now.velocities[:, free]], axis=1)
    return moving.reshape(len(moving), -1)
