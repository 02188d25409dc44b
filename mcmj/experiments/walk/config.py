"""What the walking experiment runs: its Config, and the body with its gaits."""

from dataclasses import dataclass, field
from itertools import permutations

from mcmj.core.body import Body
from mcmj.mjcf.bundled import open_body
from mcmj.robots.quadruped import Quadruped
from mcmj.robots.recorded_walk import PUSH_DURATION
from mcmj.robots.walk_scene import INTEGRATOR
from mcmj.targets.gaits import GAITS, LEGS
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.validation import (
    Array,
    require_count,
    require_duration,
    require_names,
    require_number,
    require_seed,
    require_timestep,
)

PARTS = ("walk", "switch", "push", "adapt", "recover", "steps", "cost")
USUAL_PARTS = ("walk", "switch", "push", "cost")  # the others take ten minutes more
SHORTEST = 15.5  # s of the body as it was taught in which a stride is measured: three of a walk


@dataclass(frozen=True)
class Config:
    """What to run.

    Attributes:
        gaits: which; the first is the one whose push and switch the video shows.
        body: a body file with readouts of these gaits, or the name of a body of mcmj's.
        parts: of the experiment: walk in every gait; switch between them while walking; push
            and count falls; adapt to slope and load, and recover from pushes at every moment of
            the stride, both with and without coupling; steps: the same walk at other time
            steps; cost of a step beside the planar scene.
        seed: of the pushes' directions and moments, and of the teaching's noise.
        pace: of the body, as many times faster than it was taught.
        timestep: of the body as it was taught [s]; the scene's is that over the pace.
        settle: walking that is not measured [s]; a pace needs 10.
        walking: walking that is [s].
        before, after: what switch, adapt and recover watch comes after this time, and lasts so
            long [s].
        moments: of the stride at which a switch, or a push of recover, is made.
        seeds: number of pushes of each size in each gait.
        impulses: sizes of the pushes [N s], in all horizontal directions, for 0.1 s.
        survive: a push is survived if the robot does not fall for so long [s].
        coupling: g, of the legs' load into the body where the ground is part of the computer.
        slopes: of the ground for adapt, beside level ground [degrees], uphill positive.
        loads: on the trunk for adapt, beside none [kg].
        starts: moments of the stride at which adapt puts the robot on each ground.
        nudge: pushes of recover [N s].
        steps_ms: time steps for steps, beside timestep, of the body as it was taught [ms].
        robot: its sizes and servos.
    """

    gaits: tuple[str, ...] = tuple(GAITS)
    body: str = "gaits"
    parts: tuple[str, ...] = USUAL_PARTS
    seed: int = 0
    pace: float = 8.0
    timestep: float = 1e-3
    settle: float = 10.0
    walking: float = 10.0
    before: float = 3.0
    after: float = 6.0
    moments: int = 4
    seeds: int = 20
    impulses: tuple[float, ...] = (100.0, 150.0, 200.0)
    survive: float = 3.0
    coupling: float = 0.4
    slopes: tuple[float, ...] = (-6.0, -3.0, 3.0, 6.0)
    loads: tuple[float, ...] = (25.0, 50.0)
    starts: int = 2
    nudge: float = 150.0
    steps_ms: tuple[float, ...] = (0.5, 2.0)
    robot: Quadruped = field(default_factory=Quadruped)

    def __post_init__(self) -> None:
        require_names("gait", self.gaits, GAITS)
        require_names("part", self.parts, PARTS)
        require_seed("seed", self.seed)
        require_count("seeds", self.seeds, 1)
        require_count("moments", self.moments, 1)
        require_count("starts", self.starts, 1)
        require_timestep("timestep", self.timestep)
        require_number("pace", self.pace, 0.0, open_low=True)
        for name in ("walking", "before", "after", "survive", "settle"):
            require_duration(
                name, getattr(self, name), self.timestep / self.pace, open_low=name != "settle"
            )
        require_number("survive", self.survive, 2 * PUSH_DURATION)
        if {"adapt", "recover"} & set(self.parts):
            require_number("after", self.after, SHORTEST / self.pace)
        require_number("nudge", self.nudge, 0.0)
        require_number("coupling", self.coupling, -10.0, 10.0)
        if self.coupling == 0.0:
            raise InvalidArgumentError("coupling", "a number other than 0", self.coupling)
        for slope in self.slopes:
            require_number("slopes", slope, -45.0, 45.0)
        for name in ("impulses", "steps_ms"):
            if not getattr(self, name):
                raise InvalidArgumentError(name, "at least one", ())
        for name in ("impulses", "steps_ms", "loads"):
            for value in getattr(self, name):
                require_number(name, value, 0.0, open_low=True)

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """All ordered switches."""
        return tuple(permutations(self.gaits, 2))


def get_body(config: Config) -> tuple[Body, dict[str, Array]]:
    """The body, and its readouts of the gaits.

    Raises:
        InvalidArgumentError, UnknownNameError: a body without one of them, or not four legs.
    """
    stored = open_body(config.body)
    stored.take(timestep=config.timestep, integrator=INTEGRATOR)
    body, readouts = stored.body, stored.readouts
    if body.n_outputs != len(LEGS):
        raise InvalidArgumentError("body", f"{len(LEGS)} feedback channels", body.n_outputs)
    for name in config.gaits:
        if name not in readouts:
            raise UnknownNameError("readout of the body", name, readouts)
    return body, {name: readouts[name] for name in config.gaits}


def total_steps(config: Config) -> int:
    """Steps of all parts, for a progress bar."""
    whole, count = config.settle + config.walking, len(config.gaits)
    grounds = 1 + len(config.slopes) + len(config.loads)
    seconds = {
        "walk": count * whole,
        "switch": len(config.pairs) * (config.before + config.moments * config.after),
        "push": count * len(config.impulses) * config.seeds * config.survive,
        "adapt": count * 2 * grounds * config.starts * (config.before + config.after),
        "recover": count * 2 * 3 * config.moments * config.after,
        "steps": count * sum(whole / (step * 1e-3 / config.timestep) for step in config.steps_ms),
        "cost": 0.0,
    }
    return round(sum(seconds[part] for part in config.parts) * config.pace / config.timestep)
