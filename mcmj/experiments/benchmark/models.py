"""What the closed loop costs on the models of mcmj.experiments.adopt, which are no bodies."""

from functools import partial
from typing import Any

import mujoco
import numpy as np

from mcmj.experiments.adopt.models import ADOPTIONS
from mcmj.experiments.benchmark.config import READOUT_SIZE, Config
from mcmj.simulation.models.adopt import read_spec
from mcmj.simulation.reservoir import Reservoir
from mcmj.utils.errors import MissingExtraError
from mcmj.utils.quiet import untimed
from mcmj.utils.timing import Work, interleaved_seconds, median_ratio

COPIES = 8
OUTPUTS = 2


def model_costs(config: Config, body: object) -> dict[str, object]:
    """Closed loop over bare mj_step of the same model, and two threads against one.

    Signals and outputs are recorded. Both start from rest; the readout does next to nothing, so
    that both make the same motion. Rollouts stop MuJoCo's clock (utils.quiet), a bare mj_step does
    not; the second ratio is over one that does. Copies record nothing. Models of dm_control's
    suite are left out where it is not installed.
    """
    ratios, alike, threads = {}, {}, {}
    for name, adoption in ADOPTIONS.items():
        try:
            spec = read_spec(adoption.load(), adoption.timestep)
        except MissingExtraError:
            continue
        ratios[name], alike[name] = _closed_over_bare(config, spec, adoption.sensors)
        threads[name] = _two_threads(config, spec, adoption.sensors)
    return {
        "reservoir_ratio": ratios,
        "reservoir_ratio_same_clock": alike,
        "reservoir_threads2_speedup": threads,
    }


def _reservoir(spec: mujoco.MjSpec, sensors: tuple[str, ...], **options: Any) -> Reservoir:
    """Every output drives all actuators, next to nothing."""
    names = [actuator.name for actuator in spec.actuators]
    channels = {f"x{c + 1}": dict.fromkeys(names, READOUT_SIZE) for c in range(OUTPUTS)}
    reservoir = Reservoir(spec, sensors=sensors, channels=channels, **options)
    reservoir.set_readout(np.full((reservoir.n_signals, OUTPUTS), READOUT_SIZE))
    return reservoir


def _closed_over_bare(
    config: Config, spec: mujoco.MjSpec, sensors: tuple[str, ...]
) -> tuple[float, float]:
    """Over mj_step as it is, and with MuJoCo's clock stopped."""
    closed, model = _reservoir(spec, sensors), spec.compile()
    data = mujoco.MjData(model)

    def bare() -> None:
        mujoco.mj_resetData(model, data)
        mujoco.mj_step(model, data, nstep=config.steps)

    def without_clock() -> None:
        with untimed():
            bare()

    def loop() -> None:
        closed.reset()
        closed.rollout(config.steps)

    works = {"closed": loop, "bare": bare, "without_clock": without_clock}
    seconds = interleaved_seconds(works, config.repeats)
    return (
        median_ratio(seconds, "closed", "bare"),
        median_ratio(seconds, "closed", "without_clock"),
    )


def _two_threads(config: Config, spec: mujoco.MjSpec, sensors: tuple[str, ...]) -> float:
    works: dict[str, Work] = {}
    for count in (1, 2):
        copies = _reservoir(spec, sensors, copies=COPIES, threads=count)
        works[f"{count}"] = partial(copies.rollout, max(10, config.steps // COPIES), record=())
    return median_ratio(interleaved_seconds(works, config.repeats), "1", "2")
