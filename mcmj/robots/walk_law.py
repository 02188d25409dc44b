"""The law that joins body and legs: what drives each actuator of the scene, all of it linear.

Two commands a leg, its position x_i and its lift z_i, are readouts of the springs, or what a
teacher says in their place. With b_i, b_i' the length and rate that the leg's sensors measure,
the force [N] or torque [N m] of the actuators of leg i is

    feedback  x_i
    hip       K (A_i x_i + c_i)
    leg       k B_i z_i
    input     u_i = g F_i / (M gravity)      F_i = k (b_i - B_i z_i) + d b_i'

beside the servos' own springs and dampers (robots.quadruped). F_i is the force that the servo of
leg i bears, M the robot's mass without load. Input i pushes the nodes that feedback channel i
pushes, as strongly. With g = 0 the body does not know of the robot.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mcmj.robots.quadruped import GRAVITY, Quadruped, Stride
from mcmj.robots.walk_scene import LEG_SENSORS, ROBOT
from mcmj.targets.gaits import LEGS
from mcmj.utils.validation import Array

COMMANDS = 2 * len(LEGS)  # x_i, then z_i


@dataclass(frozen=True, eq=False)
class LegLaw:
    """forces = commands @ (x, z) + sensors @ (b_1, b_1', b_2, ..) + offset

    Attributes:
        commands: (n_actuators, COMMANDS).
        sensors: (n_actuators, LEG_SENSORS).
        offset: (n_actuators,).
    """

    commands: Array
    sensors: Array
    offset: Array

    def weights(self, readout: Array) -> Array:
        """User data (n_actuators, L + LEG_SENSORS + 1) if the commands are readouts (L + 1, 8)."""
        heard = self.commands @ readout.T
        return np.column_stack([heard[:, :-1], self.sensors, heard[:, -1] + self.offset])


def leg_law(actuators: Sequence[str], robot: Quadruped, stride: Stride, coupling: float) -> LegLaw:
    """The law of a gait's stride; actuators that it leaves alone have rows of zeros.

    Args:
        actuators: names of all of the scene, in its order.
        coupling: g.
    """
    n, row = len(actuators), {name: index for index, name in enumerate(actuators)}
    law = LegLaw(np.zeros((n, COMMANDS)), np.zeros((n, LEG_SENSORS)), np.zeros(n))
    swing, lean, lift = (stride.of_legs(name) for name in ("swing", "lean", "lift"))
    bearing = coupling / (robot.mass * GRAVITY)
    for i, leg in enumerate(LEGS):
        position, lifted, length, rate = i, len(LEGS) + i, 2 * i, 2 * i + 1
        feedback, hip, drawn, heard = (row[name] for name in actuators_of(leg, channel=i))
        law.commands[feedback, position] = 1.0
        law.commands[hip, position] = robot.hip_stiffness * swing[i]
        law.offset[hip] = robot.hip_stiffness * lean[i]
        law.commands[drawn, lifted] = robot.leg_stiffness * lift[i]
        law.commands[heard, lifted] = -bearing * robot.leg_stiffness * lift[i]
        law.sensors[heard, length] = bearing * robot.leg_stiffness
        law.sensors[heard, rate] = bearing * robot.leg_damping
    return law


def actuators_of(leg: str, *, channel: int) -> tuple[str, str, str, str]:
    """Names of a leg's actuators under the law: feedback, hip, leg, input."""
    return f"fb{channel}", f"{ROBOT}{leg}_swing", f"{ROBOT}{leg}_lift", f"in{channel}"
