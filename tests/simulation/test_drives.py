"""What pushes a body, against the slow twin: inputs, offsets, gates, forces, hooks."""

import numpy as np
import pytest
import twins
from rollouts import ALL, T, assert_same, changed, part, same_bits

from mcmj import Simulation
from mcmj.utils.errors import InvalidArgumentError


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
@pytest.mark.parametrize("substeps", [2, 5])
def test_substeps_hold_everything(body, w_bias, drive, integrator, substeps):
    options = {"w_out": w_bias, "integrator": integrator, "substeps": substeps, "timestep": 2e-3}
    run = Simulation(body, **options).rollout(**drive, record=ALL)
    assert_same(run, twins.run(body, T, **options, **drive))


@pytest.mark.parametrize("names", [("inputs",), ("offset",), ("forces",), ("inputs", "forces")])
def test_each_drive_alone(body, drive, names):
    some = {name: drive[name] for name in names}
    run = Simulation(body, integrator="Euler").rollout(**some, record=ALL)
    assert np.abs(run.velocities).max() > 0.01
    assert_same(run, twins.run(body, T, **some))


def test_gate_defaults_to_one_with_a_readout_and_zero_without(body, w_out):
    closed = Simulation(body, w_out=w_out).rollout(50).lengths
    assert closed.tobytes() == Simulation(body, w_out=w_out).rollout(50, gate=1.0).lengths.tobytes()
    opened = Simulation(body, w_out=w_out).rollout(50, gate=0.0)
    assert opened.lengths.tobytes() == Simulation(body).rollout(50).lengths.tobytes()
    assert np.abs(opened.outputs).max() > 0.1  # the readout still reads
    assert not np.array_equal(closed, opened.lengths)


def test_constant_forces_equal_the_same_over_time(body):
    forces = np.linspace(-3, 3, body.n_nodes)
    simulation = Simulation(body, integrator="Euler")

    def run(steps=None, **push):
        simulation.reset()
        return simulation.rollout(steps, **push, record=ALL)

    constant, one_row = run(100, forces=forces), run(100, forces=forces[None])
    varying = run(forces=np.tile(forces, (100, 1)))
    assert same_bits(constant, varying)
    assert same_bits(constant, one_row)
    assert_same(constant, twins.run(body, 100, forces=forces))


def test_nothing_that_pushed_pushes_in_the_next_rollout(body, drive):
    simulation = Simulation(body, integrator="Euler")
    simulation.rollout(**drive)
    simulation.rollout(10, forces=np.ones(body.n_nodes))
    state = simulation.state
    run = simulation.rollout(100, record=ALL)
    twin = twins.run(body, 100, positions=state.positions, velocities=state.velocities)
    assert_same(run, twin)


def test_outputs_are_the_readout_of_the_lengths(body, w_bias, w_out):
    run = Simulation(body, w_out=w_bias).rollout(50)
    assert run.outputs == pytest.approx(run.lengths @ w_bias[:-1] + w_bias[-1], rel=1e-13)
    simulation = Simulation(body)
    assert not simulation.rollout(5).outputs.any()
    simulation.set_readout(w_out)
    run = simulation.rollout(50)
    assert run.outputs == pytest.approx(run.lengths @ w_out, rel=1e-13)
    simulation.set_readout(None)
    assert simulation.w_out is None
    assert not simulation.rollout(5).outputs.any()


def test_hook_equals_the_same_forces_given_in_advance(body, w_bias, drive):
    steps = 60
    forces = np.random.default_rng(5).normal(size=(steps, body.n_nodes))
    shorter = part(drive, 0, steps)
    seen = []

    def hook(time, lengths):
        seen.append((time, lengths))
        return forces[len(seen) - 1]

    run = Simulation(body, w_out=w_bias).rollout(**shorter, hook=hook, record=ALL)
    shorter["forces"] = shorter["forces"] + forces
    wanted = Simulation(body, w_out=w_bias).rollout(**shorter, record=ALL)
    assert same_bits(run, wanted)
    assert [time for time, _ in seen] == pytest.approx(list(run.times), abs=1e-15)
    assert np.abs(np.array([lengths for _, lengths in seen]) - run.lengths).max() < 1e-13


@pytest.mark.parametrize("options", [{}, {"substeps": 3}, {"integrator": "RK4"}])
def test_hook_can_be_a_spring_of_its_own(oscillator, options):
    """A hook that pulls by -k (l - l0) equals a stiffer spring, held over the control step."""

    def hook(time, lengths):
        return [0.0, -4.0 * (lengths[0] - 1.0)]

    run = Simulation(oscillator, timestep=1e-2, **options).rollout(200, hook=hook)
    feedback = changed(oscillator, w_fb=[[0.0], [-4.0]])
    wanted = Simulation(feedback, w_out=[[1.0], [-1.0]], timestep=1e-2, **options).rollout(200)
    assert np.abs(run.lengths - wanted.lengths).max() < 1e-14
    assert np.ptp(run.lengths) > 0.5


def test_hook_must_return_a_force_per_node(body):
    with pytest.raises(InvalidArgumentError) as caught:
        Simulation(body).rollout(3, hook=lambda time, lengths: [1.0, 2.0])
    assert str(caught.value) == "hook's forces: expected shape (8), got shape (2,)"
