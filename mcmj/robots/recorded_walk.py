"""A walk of a robot that is a reservoir: let it go on, and read off where it is and what it does.

The model's sensors say what feet bear and what actuators do, by the endings of their names:
_contact [N], one a leg, _force [N or N m] and _speed [m/s or rad/s], one an actuator each.
"""

from collections.abc import Callable, Mapping

import numpy as np

from mcmj.core.trajectory import join
from mcmj.robots.walk_metrics import Walk
from mcmj.simulation.reservoir import Reservoir
from mcmj.targets.gaits import LEGS
from mcmj.utils.validation import MOST_STEPS, Array, require_count, require_number

PUSH_DURATION = 0.1  # s, of forces at the beginning
CHUNK = 2048  # steps of all copies whose records are thinned at a time


def record_walk(
    robot: Reservoir,
    duration: float,
    sample: float,
    pose: Callable[[Array], Array],
    *,
    impulses: Mapping[str, Array] | None = None,
    told: float | None = None,
    n_outputs: int = len(LEGS),
    joints: bool = False,
) -> Walk:
    """Go on for a while in closed loop, or as the readout is.

    Args:
        duration: [s].
        sample: time between samples [s], rounded to whole steps.
        pose: position and orientation of the trunk (.., 7) from qpos (.., nq).
        impulses: on bodies (3,) or (copies, 3) [N s], by constant forces over the first
            PUSH_DURATION, in whole samples.
        told: the robot's one input, held.
        n_outputs: so many, the first, are kept.
        joints: keep all joints, for videos.

    Raises:
        DivergenceError: a copy blew up.
        InvalidArgumentError: shorter than a sample.
    """
    require_number("sample", sample, 0.0, open_low=True)
    every = max(1, round(sample / robot.timestep))
    count = round(duration / (every * robot.timestep))
    require_count("duration / sample", count, 1, MOST_STEPS)
    pushed = round(PUSH_DURATION / (every * robot.timestep))
    pushed = min(count, max(1, pushed)) if impulses else 0
    lasts = pushed * every * robot.timestep
    forces = {body: impulse / lasts for body, impulse in (impulses or {}).items()}
    chunk = every * max(1, CHUNK // (every * (robot.copies or 1)))
    parts = []
    for samples, acting in ((pushed, forces), (count - pushed, None)):
        if samples > 0:
            steps = samples * every
            run = robot.stream(
                steps, None if told is None else np.full((steps, 1), told), forces=acting,
                record=("outputs", "qpos", "sensordata"), chunk=chunk,
            )  # fmt: skip
            parts += [part.thinned(every) for part in run]
    whole = join(parts)
    outputs, qpos, sensors = (  # the first axis of a walk's arrays are the copies
        whole.get(name).reshape(robot.copies or 1, len(whole), -1)
        for name in ("outputs", "qpos", "sensordata")
    )
    power = sensors[..., _places(robot, "_force")] * sensors[..., _places(robot, "_speed")]
    return Walk(
        times=whole.times - whole.times[0],
        trunk=pose(qpos),
        outputs=outputs[..., :n_outputs],
        contact=sensors[..., _places(robot, "_contact")],
        power=np.maximum(power, 0.0).sum(axis=-1),
        net=power.sum(axis=-1),
        joints=qpos if joints else None,
    )


def _places(robot: Reservoir, ending: str) -> list[int]:
    """In sensordata, of sensors whose names end so."""
    names = [robot.model.sensor(i).name for i in range(robot.model.nsensor)]
    return [int(robot.model.sensor(name).adr[0]) for name in names if name.endswith(ending)]
