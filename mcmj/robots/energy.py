"""Where a robot's work goes: an energy balance, from every step of a run.

    change of energy = work of the muscles' commands - dampers of muscles and trunk - ground

Energy is kinetic, of height and of the springs (k1 x^2 / 2 + k3 x^4 / 4, muscles without their
commands). Each term is computed by itself, forces at the start of a step and speeds as the mean
over it; the ground's is that of MuJoCo's constraint forces. What is left over is the
integrator's error.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from mcmj.core.body import spring_lengths
from mcmj.robots.quadruped import GRAVITY
from mcmj.robots.trunk import Trunk
from mcmj.simulation.reservoir import Reservoir
from mcmj.utils.validation import Array


@dataclass(frozen=True)
class Balance:
    """Of a run.

    Attributes:
        work: of the muscles' commands, net [J].
        positive: the same, of each muscle and step that gives work only [J].
        muscles, trunk, ground: what is lost in dampers and on the ground [J].
        change: of the energy from start to end [J].
    """

    work: float
    positive: float
    muscles: float
    trunk: float
    ground: float
    change: float

    @property
    def error(self) -> float:
        """What does not close, over the work."""
        lost = self.muscles + self.trunk + self.ground
        return abs(self.change - self.work + lost) / abs(self.work)


def energy_balance(
    robot: Reservoir, trunk: Trunk, steps: int, offset: Array | None = None
) -> Balance:
    """Go on for so many steps as the readout is, and account for them.

    Args:
        offset: (steps, n_muscles) commands in place of the readout's [m].
    """
    body, n = trunk.body, trunk.n_sensed
    gate = None if offset is None else 0.0
    run = robot.rollout(steps, None, offset, gate, record=("qpos", "qvel", "outputs"))
    places = np.vstack([run.get("qpos"), robot.qpos])
    speeds = np.vstack([run.get("qvel"), robot.qvel])
    mean = (speeds[1:] + speeds[:-1]) / 2
    along = _directions(trunk, places[:-1])
    rates, mean_rates = (_rates(trunk, along, v) for v in (speeds[:-1], mean))
    strength = trunk.settings.muscle_strength
    told = run.get("outputs") if offset is None else offset
    pulls = np.clip(trunk.settings.muscle_stiffness * told, -strength, strength)
    power = pulls * mean_rates[:, n:]
    lost = (body.d1 * rates + body.d3 * rates**3) * mean_rates
    energy = _energies(trunk, places[[0, -1]], speeds[[0, -1]])
    h = robot.timestep
    return Balance(
        work=h * power.sum(),
        positive=h * np.maximum(power, 0.0).sum(),
        muscles=h * lost[:, n:].sum(),
        trunk=h * lost[:, :n].sum(),
        ground=-h * (_ground_forces(robot, places[:-1], speeds[:-1], told) * mean).sum(),
        change=energy[1] - energy[0],
    )


def _directions(trunk: Trunk, places: Array) -> Array:
    """Unit vectors (T, L, D) of the springs."""
    nodes = trunk.body.positions + places.reshape(len(places), *trunk.body.positions.shape)
    apart = nodes[:, trunk.body.springs[:, 1]] - nodes[:, trunk.body.springs[:, 0]]
    found: Array = apart / np.linalg.norm(apart, axis=-1, keepdims=True)
    return found


def _rates(trunk: Trunk, along: Array, speeds: Array) -> Array:
    """dl/dt (T, L) [m/s]."""
    nodes = speeds.reshape(len(speeds), *trunk.body.positions.shape)
    ends = nodes[:, trunk.body.springs[:, 1]] - nodes[:, trunk.body.springs[:, 0]]
    found: Array = (along * ends).sum(axis=-1)
    return found


def _energies(trunk: Trunk, places: Array, speeds: Array) -> Array:
    """Kinetic, of height, and of springs (T,) [J]."""
    body = trunk.body
    shape = (len(places), *body.positions.shape)
    nodes, rates = body.positions + places.reshape(shape), speeds.reshape(shape)
    longer = spring_lengths(nodes, body.springs) - body.rest_lengths
    kinetic = (body.masses[:, None] * rates**2).sum(axis=(1, 2)) / 2
    height = GRAVITY * nodes[..., -1] @ body.masses
    springs = (body.k1 * longer**2 / 2 + body.k3 * longer**4 / 4).sum(axis=1)
    found: Array = kinetic + height + springs
    return found


def _ground_forces(robot: Reservoir, places: Array, speeds: Array, told: Array) -> Array:
    """MuJoCo's constraint forces (T, nv) [N] in these states, the muscles told c (T, n_muscles)."""
    model, outputs = robot.model, robot.in_mujoco.channels.outputs
    data, found = mujoco.MjData(model), np.empty_like(speeds)
    for force, qpos, qvel, ctrl in zip(found, places, speeds, told, strict=True):
        data.qpos[:], data.qvel[:] = qpos, qvel
        data.ctrl[outputs] = ctrl
        mujoco.mj_forward(model, data)
        force[:] = data.qfrc_constraint
    return found
