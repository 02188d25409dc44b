"""MuJoCo models learn a rhythm through their own sensors and actuators, and go on by themselves.

Teacher forcing from the model's start, then practice from there (DAgger), with one and the same
setting for all models; each of several readouts is then judged in free runs: on from the end of
the teaching, from the model's start, after an output was held, after a kick.
"""

import numpy as np

from mcmj.analysis.capacities import capacities_of
from mcmj.experiments.adopt.config import Config
from mcmj.experiments.adopt.models import build
from mcmj.experiments.adopt.result import Adopted, Motion, Result, Trial
from mcmj.experiments.blow_ups import or_lost
from mcmj.learning.practice import practise
from mcmj.learning.teaching import Course, lessons_of
from mcmj.metrics import orbits
from mcmj.simulation.reservoir import Reservoir
from mcmj.targets.limit_cycles import Target
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array

RECOVERED = 0.1  # of the orbit's RMS radius
SHOWN = 5  # periods of motion that are kept


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Teach all models, judge them, and measure what they are worth.

    Args:
        on_steps: called with 1 after every readout and every measure, for progress bars.

    Raises:
        MissingExtraError: a model of dm_control's suite, without dm_control.
    """
    return Result(config, {name: adopt(config, name, on_steps) for name in config.names})


def adopt(config: Config, name: str, on_steps: OnSteps = lambda steps: None) -> Adopted:
    """One model; see `run`."""
    target = config.target(name)
    radius = orbits.rms_radius(target.orbit(orbits.ORBIT_POINTS))
    built = build(config.adoption(name), target, radius)
    reservoir, trials, motion, w_out = built.reservoir, [], None, None
    for seed in range(config.seed, config.seed + config.seeds):
        judge = _Judge(config, reservoir, target, seed)
        trials.append(or_lost(judge.trial, Trial(seed)))
        if motion is None and judge.motion is not None:
            motion, w_out = judge.motion, reservoir.w_out
        on_steps(1)
    worth = None
    if config.symbols:
        worth = or_lost(lambda: capacities_of(reservoir, config.probe(target)), None)
    on_steps(1)
    reservoir.reset()
    reservoir.set_readout(w_out)
    return Adopted(
        reservoir,
        len(built.gains),
        target,
        tuple(trials),
        np.nan if motion is None else built.largest_control(motion.outputs),
        motion,
        worth,
    )


class _Judge:
    """Teaches a reservoir one readout, and judges it."""

    def __init__(self, config: Config, reservoir: Reservoir, target: Target, seed: int) -> None:
        self._config, self._reservoir, self._target, self._seed = config, reservoir, target, seed
        self.motion: Motion | None = None  # of the free run

    def trial(self) -> Trial:
        """Teach and judge.

        Raises:
            DivergenceError: the model blew up under the teacher, or in the free run.
        """
        reservoir, target, config = self._reservoir, self._target, self._config
        nrmse, rounds = self._teach()
        outputs = self._run(config.free_run)
        period_error = orbits.relative_period_error(
            outputs[-self._steps(config.window) :], reservoir.timestep, target
        )
        self.motion, speeds = self._keep_motion()
        before, held = reservoir.snapshot(), self.motion.outputs[-1]
        after_freeze = or_lost(lambda: self._error(self._after_freeze(held)), np.inf)
        reservoir.restore(before)
        kicked = or_lost(lambda: self._after_kick(speeds), None)
        reservoir.reset()
        from_rest = or_lost(lambda: self._error(self._run(config.free_run)), np.inf)
        return Trial(
            self._seed, nrmse, rounds, self._error(outputs), from_rest, after_freeze,
            np.inf if kicked is None else self._error(kicked),
            np.inf if kicked is None else orbits.recovery_time(
                kicked, reservoir.timestep, target, tolerance=RECOVERED
            ),
            period_error,
        )  # fmt: skip

    def _teach(self) -> tuple[float, int]:
        """Training error of the readout, and rounds of practice."""
        reservoir, target, config = self._reservoir, self._target, self._config
        radius = orbits.rms_radius(target.orbit(orbits.ORBIT_POINTS))
        teaching = config.teaching(target.period, radius)
        reservoir.set_readout(None)
        reservoir.reset()
        course = Course(reservoir, teaching, self._seed)
        course.attend_all(lessons_of(target, teaching))
        practised = practise(course, target, config.practice(target.period))
        return practised.fit.train_nrmse, len(practised.errors) - 1

    def _steps(self, seconds: float) -> int:
        return round(seconds / self._reservoir.timestep)

    def _run(self, seconds: float) -> Array:
        return self._reservoir.rollout(self._steps(seconds), record=("outputs",)).get("outputs")

    def _error(self, outputs: Array) -> float:
        """Of the last part."""
        return orbits.orbit_error(outputs[-self._steps(self._config.window) :], self._target)

    def _keep_motion(self) -> tuple[Motion, Array]:
        """Some more periods, and the joints' speeds (T, nv) meanwhile."""
        found = self._reservoir.rollout(
            self._steps(SHOWN * self._target.period), record=("qpos", "qvel", "outputs")
        )
        qpos, qvel = found.get("qpos"), found.get("qvel")
        return Motion(found.times - found.times[0], qpos, found.get("outputs")), qvel

    def _after_freeze(self, last: Array) -> Array:
        """Outputs after the last of them was held for a period."""
        steps = self._steps(self._target.period)
        gate, offset = np.ones(len(last)), np.zeros((steps, len(last)))
        gate[-1], offset[:, -1] = 0.0, last[-1]
        self._reservoir.rollout(offset=offset, gate=gate, record=())
        return self._run(self._config.after)

    def _after_kick(self, speeds: Array) -> Array:
        """Outputs after every speed was changed at random, by its RMS value."""
        rms = np.sqrt((speeds**2).mean(axis=0))
        kick = rms * stream(self._seed, "kicks").standard_normal(len(rms))
        self._reservoir.set_state(qvel=speeds[-1] + kick)
        return self._run(self._config.after)
