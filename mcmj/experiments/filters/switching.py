"""Analog state switching: a memory that does not fade needs feedback (Hauser et al. 2012).

Pulses of +1 or -1 come now and then; the output must be the sign of the last one, however long
ago. A fading memory cannot: after a pause longer than the body's own time scales it has nothing
left. With the output fed back the body is taught two stable states, which a pulse switches.
`learn_switch` takes any reservoir.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mcmj.core.random_body import MOST_NODES, random_body
from mcmj.learning.regression import Regression
from mcmj.metrics import orbits
from mcmj.simulation.reservoir import Reservoir
from mcmj.simulation.simulation import Simulation
from mcmj.targets.filter_tasks import FilterTask, smooth_noise, switch
from mcmj.utils.seeds import stream
from mcmj.utils.validation import (
    Array,
    require_count,
    require_duration,
    require_number,
    require_range,
)

TIMESTEP = 1e-3  # s
WASHOUT = 5.0  # s, of the lesson
INPUT_SCALE = 10.0  # N: input weights are uniform in +- this


@dataclass(frozen=True)
class SwitchConfig:
    """How the switch is taught and tested.

    Attributes:
        pulse: length of a pulse [s].
        train_pauses: (shortest, longest) pause between pulses when taught [s].
        test_pauses: the same when tested: longer than any it was taught [s].
        lesson, exam: lengths of the runs that teach and test it [s].
        noise: standard deviation of slow noise on the fed-back teacher, so that the readout
            learns to come back to +1 or -1 from around them.
        noise_time: its time scale [s].
        ridge_per_row: ridge parameter over the number of samples.
        switch_nodes: masses of the body, which is one of those that learn rhythms.
    """

    pulse: float = 1.0
    train_pauses: tuple[float, float] = (1.0, 6.0)
    test_pauses: tuple[float, float] = (5.0, 30.0)
    lesson: float = 200.0
    exam: float = 200.0
    noise: float = 0.4
    noise_time: float = 1.0
    ridge_per_row: float = 1e-4
    switch_nodes: int = 25

    def __post_init__(self) -> None:
        for name in ("pulse", "lesson", "exam", "noise_time"):
            require_duration(name, getattr(self, name), TIMESTEP)
        for name in ("noise", "ridge_per_row"):
            require_number(name, getattr(self, name), 0.0)
        for name in ("train_pauses", "test_pauses"):
            require_range(name, getattr(self, name))
        require_count("switch_nodes", self.switch_nodes, 3, MOST_NODES)


@dataclass(frozen=True)
class SwitchResult:
    """The test: outputs (T, 1) with and without feedback, and the task.

    Attributes:
        held: share of the pauses throughout which the output had the right sign, by case.
    """

    task: FilterTask
    outputs: dict[str, Array]
    held: dict[str, float]

    @property
    def metrics(self) -> dict[str, float]:
        """As written to metrics.json; the baseline is the body without feedback."""
        errors = {name: orbits.nrmse_std(y, self.task.targets) for name, y in self.outputs.items()}
        return {
            "nrmse_std": errors["feedback"],
            "baseline_nrmse_std": errors["open"],
            "pauses_held": self.held["feedback"],
            "baseline_pauses_held": self.held["open"],
        }


def run_switch(config: SwitchConfig, seed: int, *, engine: str = "mujoco") -> SwitchResult:
    """Teach the same random body with and without feedback, then test both on long pauses."""
    body = random_body(seed, config.switch_nodes, n_inputs=1, n_outputs=1, input_scale=INPUT_SCALE)
    return learn_switch(config, Simulation(body, timestep=TIMESTEP, engine=engine), seed)


def learn_switch(config: SwitchConfig, reservoir: Reservoir, seed: int) -> SwitchResult:
    """Teach a reservoir with and without feedback, each time from its start, and test both.

    Args:
        reservoir: with one input and one output; it keeps the readout taught last.

    Raises:
        DivergenceError: it blew up.
        InvalidArgumentError: another number of inputs or outputs.
    """
    rng, timestep = stream(seed, "task_inputs"), reservoir.timestep
    lesson = make_switch(config, rng, config.lesson, config.train_pauses, timestep)
    test = make_switch(config, rng, config.exam, config.test_pauses, timestep)
    noise = config.noise * smooth_noise(
        stream(seed, "teacher_noise"), len(lesson.targets), timestep, config.noise_time
    )
    outputs = {}
    for name, teacher in (("feedback", lesson.targets + noise), ("open", None)):
        w_out = teach_switch(config, reservoir, lesson, teacher)
        reservoir.reset()
        reservoir.set_readout(w_out)
        gate = 0.0 if teacher is None else 1.0
        outputs[name] = reservoir.rollout(inputs=test.inputs, gate=gate).get("outputs")
    held = {name: pauses_held(test, y) for name, y in outputs.items()}
    return SwitchResult(test, outputs, held)


def make_switch(
    config: SwitchConfig,
    rng: np.random.Generator,
    duration: float,
    gaps: tuple[float, float],
    timestep: float = TIMESTEP,
) -> FilterTask:
    """Pulses and the wanted output for so long [s]."""
    steps = round(duration / timestep)
    return switch(rng, steps, timestep, pulse=config.pulse, gaps=gaps)


def teach_switch(
    config: SwitchConfig, reservoir: Reservoir, lesson: FilterTask, teacher: Array | None
) -> Array:
    """Readout (n_signals + 1, 1), taught with the teacher fed back, or with nothing fed back."""
    reservoir.reset()
    first, seen = round(WASHOUT / reservoir.timestep), 0
    regression = Regression(bias=True)
    drive: dict[str, Any] = {"inputs": lesson.inputs, "offset": teacher, "gate": 0.0}
    for part in reservoir.stream(**drive, record=("signals",)):
        signals = part.get("signals")
        rows = np.arange(seen, seen + len(signals))
        learned = rows >= first
        if learned.any():
            regression.add(signals[learned], lesson.targets[rows[learned]])
        seen += len(signals)
    return regression.solve(config.ridge_per_row * regression.weight).w_out


def pauses_held(task: FilterTask, outputs: Array) -> float:
    """Share of the pauses throughout which outputs (T, 1) have the sign of the targets."""
    pause = np.concatenate([[False], task.inputs[:, 0] == 0.0, [False]])
    starts, ends = (np.flatnonzero(np.diff(pause.astype(int)) == s) for s in (1, -1))
    right = np.sign(outputs[:, 0]) == np.sign(task.targets[:, 0])
    return float(np.mean([right[a:b].all() for a, b in zip(starts, ends, strict=True)]))
