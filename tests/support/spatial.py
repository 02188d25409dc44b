"""Bodies in space for the tests: random ones, planar ones lifted, any of them turned."""

from dataclasses import replace

import numpy as np

import mcmj
from mcmj.core.trajectory import State

OBLIQUE = np.array([1.0, -2.0, 2.0]) / 3


def space_body(seed=1, nodes=12, direction=OBLIQUE, **settings):
    """A random network in a box of 1 m, pushed along a direction that is no axis."""
    drawn = mcmj.random_body(
        seed, nodes, width=1.0, height=1.0, depth=1.0, d1=(0.5, 2.0), masses=(0.5, 2.0), **settings
    )
    return replace(drawn, direction=direction)


def lifted(body):
    """A planar body in the plane z = 0 of space."""
    return replace(
        body,
        positions=np.column_stack([body.positions, np.zeros(body.n_nodes)]),
        direction=np.append(body.direction, 0.0),
    )


def turned(body, turn):
    """A body turned by a matrix (D, D), with what pushes it."""
    return replace(body, positions=body.positions @ turn.T, direction=turn @ body.direction)


def random_turn(seed, dimensions=3):
    """A rotation."""
    q, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((dimensions, dimensions)))
    return q * np.sign(np.linalg.det(q))


def kicked(body, seed=2, speed=0.3):
    """The body's start with random velocities."""
    speeds = speed * np.random.default_rng(seed).standard_normal(body.positions.shape)
    return State(body.positions, np.where(body.fixed[:, None], 0.0, speeds))


def readout(body, gain=0.3):
    """A random readout that says 0 at the start."""
    w_out = gain * np.random.default_rng(3).standard_normal((body.n_springs, body.n_outputs))
    return np.vstack([w_out, -body.rest_lengths @ w_out])


def drive(body, steps, seed=4):
    """Random forces, and inputs if there are channels, as arguments of a rollout."""
    rng = np.random.default_rng(seed)
    given = {"forces": rng.uniform(-1.0, 1.0, (steps, body.n_nodes))}
    return given | {"inputs": rng.uniform(-1.0, 1.0, (steps, body.n_inputs))}
