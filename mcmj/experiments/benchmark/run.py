"""All speed claims in one place: ratios measured side by side, medians of several rounds."""

import time
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import mujoco
import numpy as np

from mcmj.core.body import Body
from mcmj.core.callbacks.online_learning import Learner
from mcmj.core.integrators import DEFAULT_INTEGRATOR, INTEGRATORS
from mcmj.core.random_body import random_body
from mcmj.core.rollout_arguments import check_drive
from mcmj.experiments.benchmark.config import Config, small_readout
from mcmj.experiments.benchmark.full_scene import full_scene
from mcmj.experiments.benchmark.lean import lean_costs
from mcmj.experiments.benchmark.models import model_costs
from mcmj.experiments.benchmark.process import machine, memory, start_up
from mcmj.experiments.benchmark.robots import robot_costs
from mcmj.experiments.benchmark.trials import trial_costs
from mcmj.reference.twin.population import Population
from mcmj.simulation.corrected_run import Stretch, run_corrected
from mcmj.simulation.ensemble import Ensemble
from mcmj.simulation.simulation import Simulation
from mcmj.utils.progress import OnSteps
from mcmj.utils.timing import Work, interleaved_seconds, median_ratio

BATCH = 64  # bodies in one call of the twin
CORRECT_EVERY = 5  # steps of 1 ms


@dataclass(frozen=True)
class Result:
    """Measured numbers, as in metrics.json, and the machine."""

    config: Config
    metrics: dict[str, object]


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Measure everything; PARTS times `on_steps(1)` is called."""
    metrics: dict[str, object] = {"machine": machine()}
    body = random_body(config.seed, config.nodes)
    for part in PARTS:
        metrics.update(part(config, body))
        on_steps(1)
    return Result(config, metrics)


def loop_costs(config: Config, body: Body) -> dict[str, object]:
    """The pipeline against a bare mj_step loop, and every way of computing spring forces."""
    w_out, steps = small_readout(body), config.steps
    closed = Simulation(body, w_out=w_out)
    python_steps = max(10, steps // 10)
    bare = mujoco.MjData(closed.model)

    def step_bare() -> None:
        """From rest, as the closed loop with its next to idle readout."""
        mujoco.mj_step(closed.model, bare, nstep=steps)

    hook, no_force = Simulation(body), np.zeros(body.n_nodes)
    works: dict[str, Work] = {
        "bare": step_bare,
        "closed": lambda: closed.rollout(steps),
        "python_hook": lambda: hook.rollout(python_steps, hook=lambda now, lengths: no_force),
    }
    open_loop = Simulation(body)
    works["open"] = lambda: open_loop.rollout(steps)
    for springs in ("cubic", "tansig"):
        # tansig springs of slope k1 k3, d1 d3 would be too stiff with the cubic's parameters
        soft = replace(body, k3=body.k3 / 100, d3=body.d3 / 100)
        simulation = Simulation(soft, w_out=w_out, springs=springs)
        works[f"{springs}_hook"] = partial(simulation.rollout, steps)
    for integrator in (name for name in INTEGRATORS if name != DEFAULT_INTEGRATOR):
        simulation = Simulation(body, w_out=w_out, integrator=integrator)
        works[integrator] = partial(simulation.rollout, steps)
    seconds = interleaved_seconds(works, config.repeats)
    seconds["python_hook"] = [s * steps / python_steps for s in seconds["python_hook"]]
    ns = float(np.median(seconds["closed"])) / (steps * body.n_springs) * 1e9
    return {
        "open_loop_ratio": median_ratio(seconds, "open", "bare"),
        "closed_loop_ratio": median_ratio(seconds, "closed", "bare"),
        "mujoco_ns_per_spring_step": ns,
        "ratio_to_closed_loop": {
            name: median_ratio(seconds, name, "closed")
            for name in seconds
            if name not in ("bare", "closed", "open")
        },
    }


def twin_costs(config: Config, body: Body) -> dict[str, object]:
    """The compiled twin in closed loop, lengths recorded: one body, and per body of a batch."""
    steps = config.steps
    simulation = Simulation(body, w_out=small_readout(body))
    others = [random_body(config.seed + k, config.nodes) for k in range(BATCH)]
    single, mixed = _population([body]), _population(others)
    packed = _population([body] * BATCH, packed=True)
    batch_steps = max(10, steps // 8)
    seconds = interleaved_seconds(
        {
            "mujoco": lambda: simulation.rollout(steps),
            "twin": _twin_work(single, steps),
            "mixed": _twin_work(mixed, batch_steps),
            "packed": _twin_work(packed, batch_steps),
        },
        config.repeats,
    )
    springs = sum(other.n_springs for other in others)
    for name, count in (("mixed", springs), ("packed", BATCH * body.n_springs)):
        scale = steps / batch_steps * body.n_springs / count  # to one body of the same size
        seconds[name] = [s * scale for s in seconds[name]]

    def ns(name: str) -> float:
        return float(np.median(seconds[name])) / (steps * body.n_springs) * 1e9

    return {
        "twin_ratio": median_ratio(seconds, "twin", "mujoco"),
        "twin_batch_ratio": median_ratio(seconds, "packed", "mujoco"),
        "twin_batch_mixed_topology_ratio": median_ratio(seconds, "mixed", "mujoco"),
        "twin_ns_per_spring_step": ns("twin"),
        "twin_batch_ns_per_spring_step": ns("packed"),
        "twin_batch_mixed_topology_ns_per_spring_step": ns("mixed"),
    }


def thread_speedups(config: Config, body: Body) -> dict[str, object]:
    """Two threads against one, for MuJoCo (nothing recorded) and the twin (outputs only)."""
    w_out, steps = small_readout(body), config.steps
    others = [random_body(config.seed + k, config.nodes) for k in range(BATCH)]
    ensembles = {n: Ensemble(body, copies=8, threads=n, w_out=w_out) for n in (1, 2)}
    twins = {n: _population(others, threads=n) for n in (1, 2)}
    works: dict[str, Work] = {}
    for n in (1, 2):
        works[f"mujoco{n}"] = partial(ensembles[n].rollout, steps, record=())
        works[f"twin{n}"] = _twin_work(twins[n], steps, lengths=False)
    seconds = interleaved_seconds(works, config.repeats)
    return {
        "threads2_speedup": median_ratio(seconds, "mujoco1", "mujoco2"),
        "twin_threads2_speedup": median_ratio(seconds, "twin1", "twin2"),
    }


def scene_costs(config: Config, body: Body) -> dict[str, object]:
    """mj_step of a needlessly complete scene over the minimal one's."""
    minimal = Simulation(body).model
    works: dict[str, Work] = {}
    for name, model in (("minimal", minimal), ("full", full_scene(body))):
        data = mujoco.MjData(model)
        works[name] = partial(mujoco.mj_step, model, data, nstep=config.steps // 4)
    seconds = interleaved_seconds(works, config.repeats)
    return {"full_scene_ratio": median_ratio(seconds, "full", "minimal")}


def growth(config: Config, body: Body) -> dict[str, object]:
    """Step time, twin's step time and compile time against the size of the body."""
    rows = []
    for nodes in config.sizes:
        other = random_body(config.seed, nodes)
        start = time.perf_counter()
        simulation = Simulation(other, w_out=small_readout(other))
        compiled = time.perf_counter() - start
        steps = max(10, config.steps * 30 // nodes // 2)
        seconds = interleaved_seconds(
            {
                "mujoco": partial(simulation.rollout, steps),
                "twin": _twin_work(_population([other]), steps),
            },
            min(config.repeats, 5),
        )
        per_spring = 1e9 / (steps * other.n_springs)
        rows.append(
            {
                "nodes": nodes,
                "springs": other.n_springs,
                "compile_seconds": compiled,
                "mujoco_ns_per_spring_step": float(np.median(seconds["mujoco"])) * per_spring,
                "twin_ns_per_spring_step": float(np.median(seconds["twin"])) * per_spring,
            }
        )
    return {"growth": rows}


def learning_costs(config: Config, body: Body) -> dict[str, object]:
    """A step in which a readout is corrected every 5 ms, over one in closed loop."""
    n, steps = body.n_springs, 8 * config.steps  # beside 1 ms for a model of its own
    simulation = Simulation(body, w_out=np.zeros((n + 1, body.n_outputs)))
    targets = np.zeros((-(-steps // CORRECT_EVERY), body.n_outputs))
    stretch = Stretch(targets, np.zeros((steps, body.n_outputs)))

    def learn() -> None:
        weights = np.zeros((body.n_outputs, n + 1))
        learner = Learner(np.eye(n + 1), weights, body.rest_lengths, np.ones(n))
        run_corrected(simulation, learner, [stretch], every=CORRECT_EVERY)

    works: dict[str, Work] = {
        "learn": learn,
        "closed": lambda: simulation.rollout(offset=stretch.offset),
    }
    seconds = interleaved_seconds(works, config.repeats)
    return {"force_learning_ratio": median_ratio(seconds, "learn", "closed")}


PARTS = (
    loop_costs,
    lean_costs,
    model_costs,
    robot_costs,
    learning_costs,
    twin_costs,
    trial_costs,
    thread_speedups,
    scene_costs,
    start_up,
    growth,
    memory,
)


def _population(bodies: list[Body], **options: Any) -> Population:
    readouts = [small_readout(body) for body in bodies]
    method = INTEGRATORS[DEFAULT_INTEGRATOR].twin
    return Population(bodies, readouts, method=method, **options)


def _twin_work(population: Population, steps: int, *, lengths: bool = True) -> Work:
    drive = check_drive(population.bodies[0], steps=steps, closed=True)
    return lambda: population.run(drive, 0, steps, lengths=lengths)
