"""Small random networks, readouts that leave them at rest, and simulations without warnings."""

import warnings

import numpy as np

import mcmj
from mcmj.utils.errors import StabilityWarning


def network(seed=0, nodes=10, *, d1=(1.0, 2.0), cubic=0.0, n_outputs=0, depth=0.0):
    cubic = (cubic, 2 * cubic)
    return mcmj.random_body(
        seed, nodes, width=1.0, height=1.0, depth=depth, k1=(50.0, 100.0), k3=cubic, d1=d1,
        d3=cubic, masses=(0.5, 2.0), n_outputs=n_outputs,
    )  # fmt: skip


def readout(body, gain):
    """A random readout whose bias makes the outputs 0 at the start, which stays at rest."""
    w_out = gain * np.random.default_rng(1).standard_normal((body.n_springs, body.n_outputs))
    return np.vstack([w_out, -body.rest_lengths @ w_out])


def simulation(body, integrator, step, w_out=None, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StabilityWarning)
        return mcmj.Simulation(body, integrator=integrator, timestep=step, w_out=w_out, **options)
