"""Delayed feedback: against the slow twin, and replayed as offsets."""

import numpy as np
import pytest
import twins
from rollouts import ALL, T, assert_same, changed

from mcmj import Simulation
from mcmj.core.integrators import INTEGRATORS
from mcmj.utils.errors import InvalidArgumentError


@pytest.mark.parametrize("integrator", ["Euler"])
@pytest.mark.parametrize("delay", [1, 2, 5])
@pytest.mark.parametrize("bias", [False, True])
@pytest.mark.parametrize("substeps", [1, 3])
def test_feedback_delay(body, w_out, w_bias, drive, integrator, delay, bias, substeps):
    """The output fed back at step k is outputs[k - delay], and 0 before there is one."""
    options = {"integrator": integrator, "w_out": w_bias if bias else w_out}
    simulation = Simulation(body, feedback_delay=delay, substeps=substeps, **options)
    run = simulation.rollout(**drive, record=ALL)
    assert_same(run, twins.run(body, T, delay=delay, substeps=substeps, **options, **drive))


def test_feedback_delay_is_refused_where_it_would_be_wrong(body):
    """MuJoCo's delayed sensors remember RK4's inner stages."""
    with pytest.raises(InvalidArgumentError, match="feedback_delay: expected 0 under RK4"):
        Simulation(body, integrator="RK4", feedback_delay=1)


@pytest.mark.parametrize("integrator", [name for name in INTEGRATORS if name != "RK4"])
def test_feedback_delay_under_every_integrator(body, w_out, integrator):
    """Replayed as offsets, the outputs shifted by the delay give the same motion."""
    late = Simulation(body, w_out=w_out, integrator=integrator, feedback_delay=2)
    run = late.rollout(T, record=ALL)
    fed = np.vstack([np.zeros((2, body.n_outputs)), run.outputs[:-2]])
    replay = Simulation(body, integrator=integrator).rollout(offset=fed, record=ALL)
    assert np.abs(run.velocities).max() > 0.01
    assert np.abs(run.lengths - replay.lengths).max() < 2e-13


@pytest.mark.parametrize("timestep", [7e-4, 1 / 300])
def test_delay_and_hold_do_not_drift_over_many_steps(oscillator, timestep):
    """Sensors know time as a sum of steps; its rounding must not shift a sample."""
    body = changed(oscillator, w_fb=[[0.0], [1.0]])
    w_out, steps = np.array([[0.8]]), 30_000
    forces = np.column_stack([np.zeros(steps), 30 * np.sin(0.05 * np.arange(steps))])
    late = Simulation(body, w_out=w_out, timestep=timestep, feedback_delay=3, substeps=3)
    run = late.rollout(forces=forces)
    fed = np.vstack([np.zeros((3, 1)), run.outputs[:-3]])
    replay = Simulation(body, timestep=timestep, substeps=3).rollout(offset=fed, forces=forces)
    assert np.ptp(run.lengths[-1000:]) > 0.01
    assert np.abs(run.lengths - replay.lengths).max() < 1e-13
