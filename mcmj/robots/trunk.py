"""A robot that is its own computer: a random network of springs on four legs of muscle.

The trunk is a random body (core.random_body) under gravity along its last axis: upright in the
x-y plane, or, with a depth, in space. Nothing is fixed, and there is no joint that could bear a
torque: a leg is a foot, one more point mass, hung from two nodes of the trunk (in space three) by
a muscle each, a spring whose rest length changes by c_j(t):

    pull of muscle j = k (l - l0 - c_j) + d l',    |k c_j| <= the muscle's strength

All forces are springs' but gravity and the ground's, which acts on the feet only. Left and right
legs hang from other nodes, or a trunk that is flat could not tell them apart.
"""

from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from mcmj.core.body import Body
from mcmj.core.random_body import MOST_NODES, Range, delaunay_springs, log_uniform
from mcmj.robots.leg_readouts import lift_of
from mcmj.targets.gaits import GAITS, LEGS, POINTS, gait_target
from mcmj.targets.limit_cycles import Target, from_array
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.seeds import stream
from mcmj.utils.validation import (
    Array,
    require_count,
    require_number,
    require_range,
)

_FLAT_HIPS = ((0, 1), (1, 2), (3, 4), (4, 5))  # a leg's fore and rear node, along the lower edge
_APART = 0.01  # m, of left and right feet from the middle, or two nodes would be in one place
CANDIDATES, _LOW = 20, 0.4  # in space: for each node; their lowest place, over the height
_INNER = 0.2  # place of the inner hips, over half the depth


@dataclass(frozen=True)
class TrunkSettings:
    """What a robot is drawn from.

    Dampers are strong, or the trunk follows the legs at once and remembers nothing.

    Attributes:
        nodes: of the trunk; some of them, along its lower edge or face, bear the legs.
        width, height: of the trunk [m].
        depth: of the trunk, from side to side [m]; 0: a robot in a plane.
        leg: height of the lower edge above the feet's centres [m].
        hip: distance of the two (outer) nodes that a leg hangs from [m].
        stance: distance of left and right feet in space [m].
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
        lags: of the lift behind the swing, over a period, in the order of mcmj.targets.gaits.GAITS.

    Raises:
        InvalidArgumentError: a number or range out of bounds.
    """

    nodes: int = 24
    width: float = 1.6
    height: float = 0.5
    depth: float = 0.0
    leg: float = 0.5
    hip: float = 0.3
    stance: float = 0.5
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
    lags: tuple[float, ...] = (0.0,) * len(GAITS)

    def __post_init__(self) -> None:
        require_count("nodes", self.nodes, 1 + len(_hips(self)[0]), MOST_NODES)
        if len(self.lags) != len(GAITS):
            raise InvalidArgumentError("lags", f"{len(GAITS)} numbers", self.lags)
        for lag in self.lags:
            require_number("lags", lag, -1.0, 1.0)
        for field in fields(self):
            if field.name in ("k1", "k3", "d1", "d3"):
                require_range(field.name, getattr(self, field.name))
            elif field.name == "depth":
                require_number("depth", self.depth, 0.0)
            elif field.name not in ("nodes", "lags"):
                require_number(field.name, getattr(self, field.name), 0.0, open_low=True)
        if 4 * self.hip >= self.width and not self.depth:
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
    def n_muscles(self) -> int:
        """Two a leg, in space three."""
        return len(LEGS) * self.body.dimensions

    @property
    def feet(self) -> Array:
        """Where they are drawn (n_legs, D) [m]."""
        found: Array = self.body.positions[self.settings.nodes :]
        return found

    @property
    def n_sensed(self) -> int:
        """Number of springs of the trunk, those that a readout hears of."""
        return self.body.n_springs - self.n_muscles

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
    hips, legs = _hips(settings)
    n, half = settings.nodes, settings.depth / 2
    if half:
        trunk = _spread(stream(seed, "topology"), hips, settings)
    else:
        low, high = (0.0, 0.1 * settings.height), (settings.width, settings.height)
        trunk = np.vstack([hips, stream(seed, "topology").uniform(low, high, (n - len(hips), 2))])
    trunk[:, -1] += settings.leg
    springs = delaunay_springs(trunk)
    feet = [_foot(settings, trunk[list(hip)], name) for hip, name in zip(legs, LEGS, strict=True)]
    muscles = [[hip, n + i] for i, leg in enumerate(legs) for hip in leg]
    own = {"k1": settings.muscle_stiffness, "k3": 0.0, "d1": settings.muscle_damping, "d3": 0.0}
    parameters = {
        name: np.concatenate([
            log_uniform(stream(seed, name), getattr(settings, name), len(springs)),
            np.full(len(muscles), value),
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


def _hips(settings: TrunkSettings) -> tuple[Array, tuple[tuple[int, ...], ...]]:
    """Places (n, D) of the nodes that bear the legs, heights 0, and which of them bear each leg."""
    w, b, half = settings.width, settings.hip, settings.depth / 2
    if not half:
        along = [w, w - b, w - 2 * b, 2 * b, b, 0.0]
        return np.column_stack([along, np.zeros(6)]), _FLAT_HIPS
    places = []
    for leg in LEGS:
        fore, y = w if leg.endswith("F") else b, side(leg) * half
        places += [[fore, y, 0.0], [fore - b, y, 0.0], [fore - b / 2, _INNER * y, 0.0]]
    return np.array(places), tuple((3 * i, 3 * i + 1, 3 * i + 2) for i in range(len(LEGS)))


def _spread(rng: np.random.Generator, hips: Array, settings: TrunkSettings) -> Array:
    """Nodes in space, hips first: each is the one of some candidates that is farthest from all.

    (Mitchell's best candidate.) Without it a node is now and then so near a triangle of others
    that the legs push it through, and the trunk stays crooked.
    """
    half = settings.depth / 2
    low, high = (0.0, -half, _LOW * settings.height), (settings.width, half, settings.height)
    nodes = hips
    while len(nodes) < settings.nodes:
        candidates = rng.uniform(low, high, (CANDIDATES, 3))
        apart = np.linalg.norm(candidates[:, None] - nodes, axis=-1).min(axis=1)
        nodes = np.vstack([nodes, candidates[apart.argmax()]])
    return nodes


def _foot(settings: TrunkSettings, hips: Array, leg: str) -> list[float]:
    middle = float(hips[:, 0].mean())
    if not settings.depth:
        return [middle + side(leg) * _APART, 0.0]
    return [middle, side(leg) * settings.stance / 2, 0.0]


def muscle_lengths(
    trunk: Trunk, swing: npt.ArrayLike, lift: npt.ArrayLike, curvature: float = 0.0
) -> Array:
    """Changes c (T, n_muscles) [m] that bring feet without load to where a gait wants them.

    Args:
        swing: (T, n_legs) x_i, 1 being the amplitude forwards of the foot's place at rest.
        lift: (T, n_legs) z_i, 1 being the whole lift.
        curvature: of the way, to the left [1/m], in space: feet go along circles about its centre.
    """
    x, z = np.asarray(swing, dtype=np.float64), np.asarray(lift, dtype=np.float64)
    body, settings = trunk.body, trunk.settings
    feet = trunk.feet
    moved = np.zeros((len(x), len(LEGS), body.dimensions))
    moved[..., 0], moved[..., -1] = settings.swing * x, settings.lift * z
    if body.dimensions == 3:
        ahead, left = (feet - feet.mean(axis=0))[:, :2].T
        moved[..., 1] = curvature * ahead * moved[..., 0]
        moved[..., 0] *= 1.0 - curvature * left
    return changes_of_length(trunk, moved)


def changes_of_length(trunk: Trunk, moved: Array) -> Array:
    """Changes c (T, n_muscles) [m] that move the feet by so much (T, n_legs, D) [m], unloaded."""
    body = trunk.body
    muscles = body.springs[trunk.n_sensed :]
    each = np.repeat(moved, body.dimensions, axis=1)  # as many muscles a leg
    legs = body.positions[muscles[:, 1]] + each - body.positions[muscles[:, 0]]
    found: Array = np.linalg.norm(legs, axis=-1) - body.rest_lengths[trunk.n_sensed :]
    return found


def muscle_target(
    trunk: Trunk, gait: str, pace: float, *, stride: float = 1.0, curvature: float = 0.0
) -> Target:
    """The muscles' changes of length in a gait of mcmj.targets.gaits, so many times faster.

    Args:
        stride: over the swing of the settings.
        curvature: of the way, see `muscle_lengths`.

    Raises:
        UnknownNameError: no such gait.
    """
    cycle = gait_target(gait)
    swing = cycle.orbit(POINTS)
    lift = lift_of(np.vstack([swing] * 3))[POINTS : 2 * POINTS]  # no ends
    lag = trunk.settings.lags[list(GAITS).index(gait)]
    lift = np.roll(lift, round(lag * POINTS), axis=0)
    lengths = muscle_lengths(trunk, stride * swing, lift, curvature)
    return from_array(gait, lengths, cycle.period / pace / POINTS)


def side(leg: str) -> float:
    """1 of a left leg, -1 of a right one."""
    return 1.0 if leg.startswith("L") else -1.0
