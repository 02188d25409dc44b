"""What the experiment of the soft robot runs: its Config."""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from mcmj.experiments.trunk import config as trunk
from mcmj.learning.force_learning import ForceLearning
from mcmj.robots.steering import LOWEST, RAMP
from mcmj.robots.trunk import TrunkSettings
from mcmj.robots.trunk_walker import STEPS
from mcmj.targets.gaits import GAITS
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import require_count, require_names, require_number

SPATIAL = TrunkSettings(
    height=0.4, depth=0.5, leg=0.38, hip=0.44, stance=0.5, mass=26.0,
    d1=(80.0, 720.0), d3=(250.0, 550.0), foot=0.03,
    muscle_stiffness=6570.0, muscle_damping=85.0, muscle_strength=600.0,
    swing=0.076, lift=0.045, lags=(0.1, 0.17, 0.12, 0.22),
)  # fmt: skip
PARTS = (
    "regression", "practice", "rest", "push", "switch", "steps", "energy", "controls", "ground",
    "cut", *LOWEST,
)  # fmt: skip


@dataclass(frozen=True)
class Config(trunk.Config):
    """What to run.

    Attributes:
        gaits: which.
        seed: of the robot, the first if there are several.
        seeds: number of robots that learn and walk; the parts are run with the first ..
        parts: .. besides: regression, practice: the same readouts by regression under a noisy
            teacher, and by practice (DAgger); rest: from standing still; push: from the side,
            count falls; switch: of the readout while walking; steps: the same walk at other time
            steps; energy: where the work goes; controls: shuffled and frozen lengths, a tape in
            place of the loop; ground: slopes and steps; cut: springs, and learning again; turn,
            brake: a robot that an input steers (turn: with a figure of eight). By name only:
            economy: a robot designed for its cost of transport.
        pace: of the gaits, as many times faster than mcmj.targets.gaits.
        walking: a walk of each gait after learning [s] ..
        judged: .. whose last part is measured [s].
        teaching: what the regression learns from [s]; its noise and ridge are those of learning.
        pushes: moments of a stride at which the robot is pushed, both ways.
        impulses: sizes of the pushes [N s], for 0.1 s.
        survive: a push or switch is survived if the robot does not fall for so long [s].
        steps_ms: time steps of the part steps [ms].
        symbols: that disturb the muscles while the trunk's capacity is measured.
        slopes, heights: of the ground, over 1, and of steps up and down in it [m].
        cut: share of the springs that are cut.
        designs: robots tried by the part economy.
        steered: gait of the robots that an input steers ..
        hold: .. how long its values are held while they learn [s].
        told: values of the input at which they are measured.
        eight: radius of the figure of eight, and how near its points are to be passed [m].
        gain: of the operator who follows it, input per radian.
        trunk: what robots are drawn from.
        learning: how they learn.
    """

    known_parts: ClassVar[tuple[str, ...]] = (*PARTS, "economy")

    parts: tuple[str, ...] = PARTS
    pace: float = 15.0
    impulses: tuple[float, ...] = (20.0, 40.0, 80.0)
    survive: float = 6.0
    steps_ms: tuple[float, ...] = (0.2, 0.4)
    symbols: int = 2000
    slopes: tuple[float, ...] = (-0.05, -0.02, 0.02, 0.05)
    heights: tuple[float, ...] = (0.01, 0.02)
    cut: float = 0.1
    designs: int = 100
    steered: str = "bound"
    hold: float = 2.0
    told: tuple[float, ...] = (-1.0, -0.8, -0.4, 0.0, 0.4, 0.8, 1.0)
    eight: tuple[float, float] = (16.0, 1.0)
    gain: float = 2.0
    trunk: TrunkSettings = SPATIAL
    learning: ForceLearning = field(
        default_factory=lambda: ForceLearning(
            period=2e-3, ridge=1e-3, noise=0.03, rounds=3, round_duration=15.0, trial=10.0
        )
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        require_names("steered", (self.steered,), GAITS)
        require_count("designs", self.designs, 1)
        require_count("symbols", self.symbols, 400)
        require_number("cut", self.cut, 0.0, 0.5, open_low=True)
        require_number("gain", self.gain, 0.0, open_low=True)
        require_number("hold", self.hold, RAMP)
        for value in self.eight:
            require_number("eight", value, 0.0, open_low=True)
        for height in self.heights:
            require_number("heights", height, 0.0, self.trunk.leg / 2)
        for slope in self.slopes:
            require_number("slopes", slope, -0.5, 0.5)
        for value in self.told:
            require_number("told", value, -1.0, 1.0)
        if 0.0 not in self.told or list(self.told) != sorted(set(self.told)):
            raise InvalidArgumentError("told", "values in order, 0 among them", self.told)
        if not self.trunk.depth:
            raise InvalidArgumentError("depth", "above 0: in a plane there is mcmj trunk", 0.0)


def total_steps(config: Config) -> int:
    """Steps at most, for a progress bar."""
    learning, walking = config.learning, config.walking
    pushes = len(config.impulses) * 2 * config.pushes
    steered = learning.total + len(config.told) * config.judged
    parts = {
        "regression": learning.washout + config.teaching + walking,
        "practice": 3 * (config.teaching + walking),
        "rest": walking,
        "push": pushes * config.survive,
        "switch": (len(config.gaits) - 1) * config.survive,
        "steps": len(config.steps_ms) * walking,
        "energy": config.judged,
        "controls": 3 * config.survive + 4 * config.pushes * config.survive,
        "ground": (len(config.slopes) + len(config.heights)) * config.judged,
        "cut": learning.total + 2 * walking,
        "economy": config.designs * (learning.warm_up + learning.round_duration + learning.trial),
        **dict.fromkeys(LOWEST, steered / len(config.gaits)),
    }
    seconds = config.seeds * (learning.total + walking) + sum(parts[p] for p in config.parts)
    return round(float(np.ceil(len(config.gaits) * seconds / STEPS[3][1])))
