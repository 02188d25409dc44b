"""Bodies and starts that are hard to integrate, by name; small, so that tests can afford them.

Unless said otherwise 10 nodes in 1 x 1 m with the springs of the toolbox (k1 1-10 N/m, k3
100-200 N/m^3, d1 0.3-6 N s/m, d3 100-200 N s^3/m^3) and masses of 1 kg, released with random
velocities of 0.5 m/s (standard deviation of each component).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mcmj.core.body import Body, spring_lengths
from mcmj.core.random_body import random_body
from mcmj.utils.seeds import stream
from mcmj.utils.validation import Array

NODES = 10
SPEED = 0.5  # m/s
PLAIN: dict[str, Any] = {
    "width": 1.0,
    "height": 1.0,
    "k1": (1.0, 10.0),
    "k3": (100.0, 200.0),
    "d1": (0.3, 6.0),
    "d3": (100.0, 200.0),
    "n_outputs": 0,
    "feedback_scale": 5.0,
}


@dataclass(frozen=True)
class HardCase:
    """A body and its start.

    Attributes:
        body: the body.
        velocities: (N, 2) at the start [m/s].
        forces: (N,) constant horizontal forces [N].
        w_out: readout, if the loop is closed.
    """

    body: Body
    velocities: Array
    forces: Array
    w_out: Array | None = None


def ordinary(seed: int) -> HardCase:
    """For comparison: nothing hard."""
    return _start(_body(seed), seed)


def stiff_springs(seed: int) -> HardCase:
    """k1 1e4-1e5, k3 1e6-1e7."""
    return _start(_body(seed, k1=(1e4, 1e5), k3=(1e6, 1e7)), seed)


def stiff_dampers(seed: int) -> HardCase:
    """d3 1e4-1e5."""
    return _start(_body(seed, d3=(1e4, 1e5)), seed)


def stiff_linear_dampers(seed: int) -> HardCase:
    """d1 1e2-1e3 and no cubic terms: stiff at any speed."""
    return _start(_body(seed, k3=(0.0, 0.0), d1=(1e2, 1e3), d3=(0.0, 0.0)), seed)


def tiny_rest_lengths(seed: int) -> HardCase:
    """Rest lengths 1e-6 m: the body starts under tension, and collapses if it can."""
    body = _body(seed)
    return _start(replace(body, rest_lengths=np.full(body.n_springs, 1e-6)), seed)


def nearly_coincident(seed: int) -> HardCase:
    """Two free nodes 1e-6 m apart, joined by a spring of that rest length."""
    body = _body(seed)
    ends = body.springs[(~body.fixed[body.springs]).all(axis=1)][0]
    positions = body.positions.copy()
    positions[ends[1]] = positions[ends[0]] + [1e-6, 0.0]
    return _start(_moved(body, positions), seed)


def nearly_collinear(seed: int) -> HardCase:
    """All nodes within 1e-6 m of a line: springs hold nothing across it."""
    body = _body(seed)
    flat = body.positions * [1.0, 1e-6]
    return _start(_moved(body, flat), seed)


def through_zero_length(seed: int) -> HardCase:
    """A mass on a line between two fixed nodes, pushed through one of them and back."""
    body = Body(
        positions=np.array([[0.0, 0.0], [1.0, 0.0], [3.0, 0.0]]),
        springs=np.array([[0, 1], [1, 2]]),
        k1=np.array([10.0, 10.0]),
        k3=np.array([0.0, 0.0]),
        d1=np.array([0.3, 0.3]),
        d3=np.array([0.0, 0.0]),
    )
    return HardCase(body, np.zeros((3, 2)), np.array([0.0, -40.0, 0.0]))


def unequal_masses(seed: int) -> HardCase:
    """Masses 1e-3 to 1e3 kg."""
    return _start(_body(seed, masses=(1e-3, 1e3)), seed)


def large_forces(seed: int) -> HardCase:
    """Constant forces of 1e4 N, either way, on every node."""
    case = _start(_body(seed), seed, speed=0.0)
    signs = stream(seed, "forces").choice([-1.0, 1.0], NODES)
    return replace(case, forces=1e4 * signs)


def fast_start(seed: int) -> HardCase:
    """Initial velocities of 100 m/s."""
    return _start(_body(seed), seed, speed=100.0)


def unstable_loop(seed: int) -> HardCase:
    """A random readout of 1e3 per metre: the loop turns the body into an oscillator."""
    body = _body(seed, n_outputs=2)
    w_out = 1e3 * stream(seed, "length_noise").standard_normal((body.n_springs, 2))
    w_out -= w_out.sum(axis=0) / body.n_springs  # small outputs at the start
    return replace(_start(body, seed), w_out=w_out)


CASES: dict[str, Callable[[int], HardCase]] = {
    case.__name__: case
    for case in (
        ordinary,
        stiff_springs,
        stiff_dampers,
        stiff_linear_dampers,
        tiny_rest_lengths,
        nearly_coincident,
        nearly_collinear,
        through_zero_length,
        unequal_masses,
        large_forces,
        fast_start,
        unstable_loop,
    )
}


def _body(seed: int, **settings: Any) -> Body:
    return random_body(seed, NODES, **PLAIN | settings)


def _start(body: Body, seed: int, speed: float = SPEED) -> HardCase:
    velocities = speed * stream(seed, "initial_state").standard_normal((body.n_nodes, 2))
    velocities[body.fixed] = 0.0
    return HardCase(body, velocities, np.zeros(body.n_nodes))


def _moved(body: Body, positions: Array) -> Body:
    """The body at rest elsewhere."""
    return replace(body, positions=positions, rest_lengths=spring_lengths(positions, body.springs))
