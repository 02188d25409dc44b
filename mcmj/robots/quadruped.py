"""A simple quadruped in MJCF: a trunk, four telescopic legs, ball feet, a servo at each joint.

Leg i swings about its hip by the angle a_i (forwards positive) and draws in by the length b_i. The
torque and the force of its two servos are those of a spring and a damper; each is one actuator,
whose ctrl is its set point, and hears nothing else:

    hip:  K (ctrl - a_i) - D a_i'       ctrl = A_i x_i + c_i    x_i  output i of the body, a
    leg:  k (ctrl - b_i) - d b_i'       ctrl = B_i z_i               leg's position
                                                                z_i  how far it is drawn in, 0 to 1

There is no gait in this model; A, B and c (Stride) are the scale and offset of a gait's readouts.
"""

from dataclasses import dataclass, fields

import numpy as np

from mcmj.mjcf.write import numbers
from mcmj.targets.gaits import LEGS
from mcmj.utils.validation import Array, as_array, require_number

GRAVITY = 9.81  # m/s^2
COMMANDS = 3 * len(LEGS)  # to body, hips and legs
ROBOT_GROUP = 1  # of geoms, for renderers that show nothing else


@dataclass(frozen=True)
class Stride:
    """How a gait uses the legs; each attribute is a pair, for the fore and the hind legs.

    Attributes:
        swing: A, amplitude of the hip angle [rad] for outputs of amplitude 1.
        lean: c, angle about which the legs swing [rad].
        lift: B, how far a leg is drawn in [m] in the middle of its swing.

    Raises:
        InvalidArgumentError: not pairs of finite numbers.
    """

    swing: tuple[float, float] = (0.2, 0.2)
    lean: tuple[float, float] = (0.065, 0.065)
    lift: tuple[float, float] = (0.076, 0.076)

    def __post_init__(self) -> None:
        for field in fields(self):
            as_array(field.name, getattr(self, field.name), (2,))

    def of_legs(self, name: str) -> Array:
        """An attribute leg by leg (4,)."""
        fore, hind = getattr(self, name)
        return np.array([fore if leg.endswith("F") else hind for leg in LEGS])

    def commands(self, positions: Array, lifts: Array, constant: Array | float = 1.0) -> Array:
        """What a gait tells body, hips and legs: x_i, A_i x_i + c_i, B_i z_i (T, COMMANDS).

        Args:
            positions, lifts: x and z (T, 4); or their readouts (L + 1, 4), for that of commands.
            constant: 1; of readouts, its readout (L + 1, 1).
        """
        hips = self.of_legs("swing") * positions + self.of_legs("lean") * constant
        return np.hstack([positions, hips, self.of_legs("lift") * lifts])


STRIDES = {  # a bound pitches the trunk, and so needs its hind legs well under it
    "bound": Stride(swing=(0.0688, 0.1033), lean=(0.0738, 0.214), lift=(0.082, 0.0731)),
}


@dataclass(frozen=True)
class Quadruped:
    """Sizes, masses and servos of the robot.

    Attributes:
        leg: length from hip to the foot's centre [m].
        foot: radius [m].
        hip_x, hip_y: distance of the hips from the trunk's middle, forwards and sideways [m].
        trunk: mass of the trunk [kg].
        upper, lower: masses of a leg's two halves [kg]; the foot is part of the lower one.
        hip_armature: inertia of a hip's motor as the joint feels it [kg m^2].
        leg_armature: mass of a leg's motor as the joint feels it [kg].
        hip_stiffness, hip_damping: K [N m/rad] and D [N m s/rad].
        leg_stiffness, leg_damping: k [N/m] and d [N s/m].
        friction: between foot and ground.

    Raises:
        InvalidArgumentError: a number out of bounds.
    """

    leg: float = 1.0
    foot: float = 0.14
    hip_x: float = 0.85
    hip_y: float = 0.4
    trunk: float = 93.5
    upper: float = 3.2
    lower: float = 2.9
    hip_armature: float = 0.32
    leg_armature: float = 0.8
    hip_stiffness: float = 13_900.0
    hip_damping: float = 515.0
    leg_stiffness: float = 14_100.0
    leg_damping: float = 510.0
    friction: float = 1.0

    def __post_init__(self) -> None:
        for field in fields(self):
            require_number(field.name, getattr(self, field.name), 0.0, open_low=True)

    @property
    def mass(self) -> float:
        """Of the whole robot [kg]."""
        return self.trunk + len(LEGS) * (self.upper + self.lower)

    @property
    def standing_height(self) -> float:
        """Of the trunk's middle above the ground, on straight legs without load [m]."""
        return self.leg + self.foot


def quadruped_mjcf(robot: Quadruped) -> str:
    """The robot as an MJCF model, for MjSpec.attach.

    Names: body trunk; per leg bodies LF, LF_lower, joints LF_hip, LF_leg, actuators of the same
    names; sensors LF_length, LF_rate of the leg's joint, then LF_contact, then of each actuator
    LF_hip_force, LF_hip_speed. Only feet touch, and only the ground (see mcmj.robots.walk_scene).
    """
    legs = "".join(_leg(robot, name) for name in LEGS)
    actuators = "".join(_actuators(robot, name) for name in LEGS)
    sensors = "".join(
        f'<jointpos name="{n}_length" joint="{n}_leg"/><jointvel name="{n}_rate" joint="{n}_leg"/>'
        for n in LEGS
    ) + "".join(f'<touch name="{n}_contact" site="{n}_foot"/>' for n in LEGS)
    sensors += "".join(
        f'<actuatorfrc name="{n}_force" actuator="{n}"/>'
        f'<actuatorvel name="{n}_speed" actuator="{n}"/>'
        for n in (f"{leg}_{joint}" for leg in LEGS for joint in ("hip", "leg"))
    )
    size = numbers([1.2 * robot.hip_x, 0.5 * robot.hip_y, 0.12 * robot.leg])
    return f"""<mujoco model="quadruped">
  <default>
    <geom contype="0" conaffinity="0" group="{ROBOT_GROUP}" rgba=".35 .4 .5 1"/>
  </default>
  <worldbody>
    <body name="trunk">
      <freejoint/>
      <light mode="trackcom" directional="true" pos="0 0 3" dir="0 0 -1" diffuse=".3 .3 .3"/>
      <geom type="box" size="{size}" mass="{robot.trunk!r}" rgba=".8 .62 .35 1"/>
      {legs}
    </body>
  </worldbody>
  <actuator>{actuators}</actuator>
  <sensor>{sensors}</sensor>
</mujoco>"""


def _leg(robot: Quadruped, name: str) -> str:
    left, fore = name[0] == "L", name[1] == "F"
    hip = numbers([robot.hip_x if fore else -robot.hip_x, robot.hip_y if left else -robot.hip_y, 0])
    half = f"0 0 0 0 0 {-robot.leg / 2!r}"
    foot = f'pos="0 0 {-robot.leg / 2!r}"'
    return f"""
      <body name="{name}" pos="{hip}">
        <joint name="{name}_hip" axis="0 -1 0" armature="{robot.hip_armature!r}"/>
        <geom type="capsule" fromto="{half}" size="{0.05 * robot.leg!r}" mass="{robot.upper!r}"/>
        <body name="{name}_lower" pos="0 0 {-robot.leg / 2!r}">
          <joint name="{name}_leg" type="slide" axis="0 0 1" armature="{robot.leg_armature!r}"/>
          <geom type="capsule" fromto="{half}" size="{0.03 * robot.leg!r}"
                mass="{0.85 * robot.lower!r}"/>
          <geom name="{name}_foot" {foot} size="{robot.foot!r}" mass="{0.15 * robot.lower!r}"
                contype="1" friction="{robot.friction!r} 0.005 0.0001" rgba=".2 .22 .28 1"/>
          <site name="{name}_foot" {foot} size="{1.1 * robot.foot!r}" rgba="0 0 0 0"/>
        </body>
      </body>"""


def _actuators(robot: Quadruped, name: str) -> str:
    servos = (
        ("hip", robot.hip_stiffness, robot.hip_damping),
        ("leg", robot.leg_stiffness, robot.leg_damping),
    )
    return "".join(
        f"""
    <general name="{name}_{joint}" joint="{name}_{joint}" gainprm="{stiffness!r}"
             biastype="affine" biasprm="0 {-stiffness!r} {-damping!r}"/>"""
        for joint, stiffness, damping in servos
    )
