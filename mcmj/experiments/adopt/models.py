"""Six models that were not made for mcmj, and how each is used as a reservoir.

Heard is what moves with the rhythm: joints, cables, speeds; not where a body has drifted to, and
not what the actuators were told. Driven are all actuators, each with gains drawn at random. The
pace fits the rhythm to the model's own time constants.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mcmj.mjcf.bundled import model_path
from mcmj.simulation.reservoir import Reservoir
from mcmj.targets.limit_cycles import Target
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array


@dataclass(frozen=True)
class Adoption:
    """A model as a reservoir.

    Attributes:
        load: gives the model: a path or an MjSpec.
        sensors, channels: as of Reservoir: what is heard, and the actuators that are driven.
        task: target, see mcmj.targets.named.
        pace: the target runs so many times faster.
        drive: an actuator's gains are uniform in +-drive over the target's RMS radius.
        gain_seed: of the gains: a good one of ten draws, found with the first noise.
        timestep: [s]; None: the model's.
    """

    load: Callable[[], Any]
    sensors: tuple[str, ...]
    channels: tuple[str, ...] = ("*",)
    task: str = "van_der_pol"
    pace: float = 1.0
    drive: float = 0.2
    gain_seed: int = 0
    timestep: float | None = None


def _of_suite(name: str) -> Any:
    from mcmj.experiments.adopt.suite_models import suite_model  # dm_control is an extra

    return suite_model(name)


CABLES = ("tendonpos:*", "tendonvel:*")
JOINTS = ("jointpos:*", "jointvel:*")
LEGS = ("yaw*", "pitch*", "knee*", "ankle*")

ADOPTIONS: dict[str, Adoption] = {
    "swimmer": Adoption(
        partial(_of_suite, "swimmer"), ("jointpos:joint_*", "jointvel:joint_*"), drive=0.6,
        gain_seed=1,  # in a fluid
    ),
    "fish": Adoption(
        partial(_of_suite, "fish"), (*JOINTS, "velocimeter", "gyro"), pace=8.0, drive=0.6,
        gain_seed=4,  # in a fluid
    ),
    "cheetah": Adoption(
        partial(_of_suite, "cheetah"),
        ("jointpos:[bf]*", "jointpos:rootz", "jointpos:rooty", "jointvel:*"),
        task="quadratic", pace=10.0, drive=0.3, gain_seed=6, timestep=0.002,  # stands on the ground
    ),
    "quadruped": Adoption(
        partial(_of_suite, "quadruped"),
        tuple(f"{kind}:{leg}" for kind in ("jointpos", "jointvel") for leg in LEGS),
        pace=2.0, drive=0.3, gain_seed=3,  # stands on the ground
    ),
    "tensegrity": Adoption(
        partial(model_path, "tensegrity"), CABLES, pace=10.0, gain_seed=3,  # lies on the ground
    ),
    "soft_arm": Adoption(
        partial(model_path, "soft_arm"), (*JOINTS, *CABLES), pace=5.0,  # hangs
    ),
}  # fmt: skip


def own_adoption(path: str, sensors: tuple[str, ...]) -> Adoption:
    """A model of one's own, from an MJCF file."""
    return Adoption(partial(Path, path), sensors)


@dataclass(frozen=True)
class Built:
    """A model with its channels.

    Attributes:
        gains: (n_actuators, n_outputs).
        limits: (2, n_actuators) least and largest control; infinite without limits.
    """

    reservoir: Reservoir
    gains: Array
    limits: Array

    def largest_control(self, outputs: Array) -> float:
        """Of any actuator under outputs (T, n_outputs), over its limit on that side."""
        controls = outputs @ self.gains.T
        over = np.maximum(controls / self.limits[1], controls / self.limits[0])
        return max(0.0, float(over.max()))


def build(adoption: Adoption, target: Target, radius: float) -> Built:
    """A model with an output for each of the target's, on all actuators, with random gains.

    Args:
        radius: the target's RMS radius.

    Raises:
        BodyFileError, UnknownNameError: no such model, sensor or actuator.
    """
    model = adoption.load()
    options: dict[str, Any] = {"sensors": adoption.sensors, "timestep": adoption.timestep}
    found = Reservoir(model, channels=adoption.channels, **options)
    actuators, draw = found.channel_names, stream(adoption.gain_seed, "channel_gains")
    size = adoption.drive / radius
    gains = draw.uniform(-size, size, (target.n_outputs, len(actuators)))
    channels = {
        f"x{c + 1}": dict(zip(actuators, row.tolist(), strict=True)) for c, row in enumerate(gains)
    }
    limits = np.full((2, len(actuators)), np.inf) * [[-1.0], [1.0]]
    for place, name in enumerate(actuators):
        actuator = found.model.actuator(name)
        if actuator.ctrllimited[0]:
            limits[:, place] = actuator.ctrlrange
    reservoir = Reservoir(model, channels=channels, **options)
    return Built(reservoir, gains.T, limits)
