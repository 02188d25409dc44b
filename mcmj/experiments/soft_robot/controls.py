"""Is it the trunk that computes? The readout on other lengths, and a tape in place of the loop."""

import numpy as np

from mcmj.experiments.blow_ups import or_lost
from mcmj.experiments.soft_robot.config import Config
from mcmj.experiments.trunk.parts import end_of
from mcmj.experiments.trunk.result import LearnedGait, Table
from mcmj.metrics.capacity import processing_capacity
from mcmj.robots.recorded_walk import PUSH_DURATION
from mcmj.robots.steering import steering_bias
from mcmj.robots.trunk_walker import has_fallen, new_robot, stand
from mcmj.simulation.held_symbols import held_states
from mcmj.simulation.reservoir import Reservoir
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array

STRIDES = 8  # of a walk whose lengths are looked at
VARIANCE = 0.999
# capacities: symbols left out first, each held so long [s], over what turns the robot
WASHOUT, HOLD, SIZE = 50, 0.1, 0.3
MAX_DELAYS = (20, 10)


def controls(config: Config, gaits: dict[str, LearnedGait], name: str, on_steps: OnSteps) -> Table:
    """Of one gait: rank and capacity; walks under shuffled and frozen lengths; pushes of a tape."""
    gait, table = gaits[name], Table(rank=rank(gaits[name]))
    for what, readout in {"shuffled": shuffled(config, gait), "frozen": frozen(gait)}.items():
        robot = gait.robot()
        robot.set_readout(readout)
        table[what] = end_of(config, gait, robot, config.survive)
        on_steps(round(config.survive / robot.timestep))
    return table | {"tape": _pushed(config, gait, on_steps), "capacity": capacity(config, gait)}


def shuffled(config: Config, gait: LearnedGait) -> Array:
    """The readout with its springs exchanged; its outputs are the same at first."""
    weights, signals = _weights(gait), gait.robot().signals
    other = stream(config.seed, "walk_moments").permutation(weights[:-1])
    return np.vstack([other, weights[-1:] + signals @ (weights[:-1] - other)])


def frozen(gait: LearnedGait) -> Array:
    """A readout that always says what it says now."""
    weights, signals = _weights(gait), gait.robot().signals
    return np.vstack([np.zeros_like(weights[:-1]), weights[-1:] + signals @ weights[:-1]])


def _weights(gait: LearnedGait) -> Array:
    assert gait.learned is not None
    return gait.learned.w_out


def rank(gait: LearnedGait) -> Table:
    """Of the lengths while the robot walks: their principal components."""
    robot = gait.robot()
    lengths = robot.rollout(round(STRIDES * gait.target.period / robot.timestep)).get("lengths")
    spread = np.linalg.svd(lengths - lengths.mean(axis=0), compute_uv=False) ** 2
    shares = np.cumsum(spread) / spread.sum()
    return {
        "components": int(np.searchsorted(shares, VARIANCE)) + 1,
        "participation": float(spread.sum() ** 2 / (spread**2).sum()),
        "springs": lengths.shape[1],
    }


def capacity(config: Config, gait: LearnedGait) -> Table:
    """What the lengths know of symbols that disturb the muscles, standing and walking.

    Each symbol is added for HOLD to the commands, times SIZE of the bias that turns the robot.
    """
    assert gait.learned is not None
    robot = new_robot(gait.trunk, bias=SIZE * steering_bias(gait.trunk, "turn"))
    robot.set_readout(gait.learned.w_out)
    symbols = stream(config.seed, "probe_inputs").uniform(-1.0, 1.0, (WASHOUT + config.symbols, 1))
    table: Table = {}
    for what, gate in (("standing", 0.0), ("walking", 1.0)):
        stand(robot)
        if gate:
            walking = gait.robot()
            robot.set_state(walking.qpos, walking.qvel)
        hold = round(HOLD / robot.timestep)
        states = or_lost(lambda: held_states(robot, symbols, hold, gate=gate), None)  # noqa: B023
        if states is None:
            table[what] = None
            continue
        found = processing_capacity(states[WASHOUT:], symbols[WASHOUT:, 0], MAX_DELAYS)
        table[what] = {
            "rank": found.rank, "memory_capacity": found.memory, "ipc_total": found.total,
        }  # fmt: skip
    return table


def _pushed(config: Config, gait: LearnedGait, on_steps: OnSteps) -> Table:
    """Pushes from the side, the loop closed, and open under a tape of what it said without them.

    How many are survived; and by how much they have moved the rhythm of the feet for good, in
    periods, which a tape's cannot.
    """
    robot, impulse = gait.robot(), config.impulses[0]
    start, steps = robot.snapshot(), round((config.survive + 1.0) / robot.timestep)
    tape = robot.rollout(steps, record=("outputs", "qpos"))
    table: Table = {"impulse_N_s": impulse}
    for what, offset, gate in (("closed", None, 1.0), ("tape", tape.get("outputs"), 0.0)):
        moved = []
        for forces in _pushes(config, gait, robot, steps, impulse):
            robot.restore(start)
            qpos = or_lost(lambda: _qpos(robot, gait, offset, gate, forces), None)  # noqa: B023
            on_steps(steps)
            if qpos is not None:
                moved.append(phase_between(qpos, tape.get("qpos"), gait, robot.timestep))
        table[what] = {
            "survived": len(moved),
            "of": 2 * config.pushes,
            "moved_periods": float(np.median(np.abs(moved))) if moved else None,
        }
    return table


def _qpos(
    robot: Reservoir, gait: LearnedGait, offset: Array | None, gate: float, forces: Array
) -> Array | None:
    """Of a run; None if the robot falls."""
    run = robot.rollout(None, None, offset, gate, forces, record=("qpos",))
    return None if has_fallen(gait.trunk)(run) else run.get("qpos")


def _pushes(
    config: Config, gait: LearnedGait, robot: Reservoir, steps: int, impulse: float
) -> list[Array]:
    """Forces (T, nv) on the trunk's nodes from either side, at moments of a stride."""
    nodes, lasts = gait.trunk.settings.nodes, round(PUSH_DURATION / robot.timestep)
    found = []
    for moment in range(config.pushes):
        first = round(moment * gait.target.period / config.pushes / robot.timestep)
        for way in (impulse, -impulse):
            forces = np.zeros((steps, robot.n_forces))
            forces[first : first + lasts, 1 : 3 * nodes : 3] = way / PUSH_DURATION / nodes
            found.append(forces)
    return found


def phase_between(one: Array, other: Array, gait: LearnedGait, step: float) -> float:
    """By how much the feet of one run (T, nq) are ahead of another's at the end, in periods.

    From the fundamentals of the feet's heights in the last strides.
    """
    stride = round(gait.target.period / step)
    last = slice(-stride * max(1, len(one) // (4 * stride)), None)
    first, second = (run[last, 3 * gait.trunk.settings.nodes + 2 :: 3] for run in (one, other))
    turn = np.exp(-2j * np.pi * np.arange(len(first)) / stride)
    a, b = (turn @ (heights - heights.mean(axis=0)) for heights in (first, second))
    return float(np.angle((a * b.conj()).sum()) / (2 * np.pi))
