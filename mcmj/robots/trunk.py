"""A robot that is its own computer: a random network of springs on four legs of muscle, in a plane.

The trunk is a random body (core.random_body), upright in the x-y plane, under gravity along -y.
Nothing is fixed, and there is no joint that could bear a torque: a leg is a foot, one more
point mass, hung from two nodes of the trunk by a muscle each, a spring whose rest length
changes by c_j(t):

    pull of muscle j = k (l - l0 - c_j) + d l',    |k c_j| <= the muscle's strength

All forces are springs' but gravity and the ground's, which acts on the feet only. Left and right
legs hang from other nodes, or the trunk, which is flat, could not tell them apart.
"""

from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from mcmj.core.body import Body
from mcmj.core.random_body import MOST_NODES, Range, delaunay_springs, log_uniform
from mcmj.robots.leg_readouts import lift_of
from mcmj.targets.gaits import LEGS, POINTS, gait_target
from mcmj.targets.limit_cycles import Target, from_array
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array, require_count, require_number, require_range

N_MUSCLES = 2 * len(LEGS)
_HIPS = {"LF": (0, 1), "RF": (1, 2), "LH": (3, 4), "RH": (4, 5)}  # a leg's fore and rear node
_APART = 0.01  # m, of left and right feet from the middle, or two nodes would be in one place


@dataclass(frozen=True)
class TrunkSettings:
    """What a robot is drawn from.

    Dampers are strong, or the trunk follows the legs at once and remembers nothing.

    Attributes:
        nodes: of the trunk; six of them, along its lower edge, bear the legs.
        width, height: of the trunk [m].
        leg: height of the lower edge above the feet's centres [m].
        hip: distance of the two nodes that a leg hangs from [m].
        mass: of the trunk, in equal parts [kg].
        k1, k3, d1, d3: ranges of its log-uniform springs, as in BodySettings.
        foot_mass: of each [kg].
        foot: radius [m].
        friction: between foot and ground.
        muscle_stiffness: k [N/m].
        muscle_damping: d [N s/m].
        muscle_strength: largest force of a change of length [N].
        swing: amplitude of a foot's way, forth and back [m].
        lift: of a foot in the middle of its swing [m].

    Raises:
        InvalidArgumentError: a number or range out of bounds.
    """

    nodes: int = 24
    width: float = 1.6
    height: float = 0.5
    leg: float = 0.5
    hip: float = 0.3
    mass: float = 24.0
    k1: Range = (1600.0, 10_000.0)
    k3: Range = (4.2e7, 9.4e7)
    d1: Range = (160.0, 1440.0)
    d3: Range = (500.0, 1100.0)
    foot_mass: float = 0.5
    foot: float = 0.04
    friction: float = 1.0
    muscle_stiffness: float = 10_000.0
    muscle_damping: float = 500.0
    muscle_strength: float = 2000.0
    swing: float = 0.1
    lift: float = 0.07

    def __post_init__(self) -> None:
        require_count("nodes", self.nodes, 7, MOST_NODES)
        for field in fields(self):
            if field.name in ("k1", "k3", "d1", "d3"):
                require_range(field.name, getattr(self, field.name))
            elif field.name != "nodes":
                require_number(field.name, getattr(self, field.name), 0.0, open_low=True)
        if 4 * self.hip >= self.width:
            raise InvalidArgumentError("hip", f"less than width / 4 = {self.width / 4}", self.hip)


@dataclass(frozen=True, eq=False)
class Trunk:
    """A robot.

    Attributes:
        body: trunk and legs; its last springs are the muscles, its last nodes the feet.
        settings: what it was drawn from.
    """

    body: Body
    settings: TrunkSettings

    @property
    def n_sensed(self) -> int:
        """Number of springs of the trunk, those that a readout hears of."""
        return self.body.n_springs - N_MUSCLES

    @property
    def mass(self) -> float:
        """Of trunk and feet [kg]."""
        return float(self.body.masses.sum())


def draw_trunk(seed: int, settings: TrunkSettings | None = None) -> Trunk:
    """Draw a robot; every quantity has its own random stream, as in mcmj.core.random_body.

    Args:
        seed: integer >= 0; the same seed and settings give the same bits.

    Raises:
        InvalidArgumentError: the seed is not an integer >= 0.
    """
    settings = settings or TrunkSettings()
    w, b, n = settings.width, settings.hip, settings.nodes
    hips = np.column_stack([[w, w - b, w - 2 * b, 2 * b, b, 0.0], np.zeros(len(LEGS) + 2)])
    inner = stream(seed, "topology").uniform(
        (0.0, 0.1 * settings.height), (w, settings.height), (n - len(hips), 2)
    )
    trunk = np.vstack([hips, inner]) + np.array([0.0, settings.leg])
    springs = delaunay_springs(trunk)
    feet = [[(trunk[list(_HIPS[leg]), 0].mean() + _side(leg) * _APART), 0.0] for leg in LEGS]
    muscles = [[hip, n + i] for i, leg in enumerate(LEGS) for hip in _HIPS[leg]]
    own = {"k1": settings.muscle_stiffness, "k3": 0.0, "d1": settings.muscle_damping, "d3": 0.0}
    parameters = {
        name: np.concatenate([
            log_uniform(stream(seed, name), getattr(settings, name), len(springs)),
            np.full(N_MUSCLES, value),
        ])
        for name, value in own.items()
    }  # fmt: skip
    body = Body(
        positions=np.vstack([trunk, feet]),
        springs=np.vstack([springs, muscles]),
        fixed=np.zeros(n + len(LEGS), dtype=np.bool_),
        masses=np.r_[np.full(n, settings.mass / n), np.full(len(LEGS), settings.foot_mass)],
        **parameters,
    )
    return Trunk(body, settings)


def muscle_lengths(trunk: Trunk, swing: npt.ArrayLike, lift: npt.ArrayLike) -> Array:
    """Changes c (T, N_MUSCLES) [m] that bring feet without load to where a gait wants them.

    Args:
        swing: (T, n_legs) x_i, 1 being the amplitude forwards of the foot's place at rest.
        lift: (T, n_legs) z_i, 1 being the whole lift.
    """
    x, z = np.asarray(swing, dtype=np.float64), np.asarray(lift, dtype=np.float64)
    body, settings = trunk.body, trunk.settings
    muscles = body.springs[trunk.n_sensed :]
    leg = np.repeat(np.arange(len(LEGS)), 2)
    moved = np.stack([settings.swing * x, settings.lift * z], axis=-1)[:, leg]
    legs = body.positions[muscles[:, 1]] + moved - body.positions[muscles[:, 0]]
    found: Array = np.linalg.norm(legs, axis=-1) - body.rest_lengths[trunk.n_sensed :]
    return found


def muscle_target(trunk: Trunk, gait: str, pace: float) -> Target:
    """The eight muscles' changes of length in a gait of mcmj.targets.gaits, so many times faster.

    Raises:
        UnknownNameError: no such gait.
    """
    cycle = gait_target(gait)
    swing = cycle.orbit(POINTS)
    lift = lift_of(np.vstack([swing] * 3))[POINTS : 2 * POINTS]  # no ends
    lengths = muscle_lengths(trunk, swing, lift)
    return from_array(gait, lengths, cycle.period / pace / POINTS)


def _side(leg: str) -> float:
    return 1.0 if leg.startswith("L") else -1.0
