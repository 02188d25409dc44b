"""Ensembles: copies on several threads are what each would be alone."""

from types import SimpleNamespace

import numpy as np
import pytest
import twins
from rollouts import ALL, SAME, VARIANTS, join, same_bits

from mcmj import Ensemble, Simulation
from mcmj.utils.errors import InvalidArgumentError


@pytest.mark.parametrize("options", VARIANTS)
def test_ensemble_equals_simulation_on_one_and_two_threads(body, w_bias, drive, options):
    alone = Simulation(body, w_out=w_bias, **options).rollout(**drive, record=ALL)
    for threads in (1, 2):
        together = Ensemble(body, copies=5, threads=threads, w_out=w_bias, **options).rollout(
            **drive, record=ALL
        )
        for copy in range(5):
            one = SimpleNamespace(**{name: together.get(name)[copy] for name in ALL})
            assert same_bits(one, alone), threads


@pytest.mark.parametrize("bias", [False, True])
def test_every_copy_has_its_own_readout_and_drive(body, bias):
    rng = np.random.default_rng(9)
    copies, steps = 4, 80
    readouts = 0.05 * rng.normal(size=(copies, body.n_springs + bias, 2))
    inputs, forces = rng.normal(size=(copies, steps, 2)), rng.normal(size=(copies, steps, 8))
    offset, velocities = rng.normal(size=(steps, 2)), 0.2 * rng.normal(size=(copies, 8, 2))
    ensemble = Ensemble(body, copies=copies, threads=2, w_out=readouts, integrator="Euler")
    ensemble.set_state(velocities=velocities)
    run = ensemble.rollout(inputs=inputs, forces=forces, offset=offset, record=ALL)
    assert run.lengths.shape == (copies, steps, body.n_springs)
    for c in range(copies):
        twin = twins.run(
            body,
            steps,
            w_out=readouts[c],
            inputs=inputs[c],
            forces=forces[c],
            offset=offset,
            velocities=velocities[c],
        )
        for name, limit in SAME.items():
            assert np.abs(run.get(name)[c] - getattr(twin, name)).max() < limit, name
    end = ensemble.state
    assert end.positions.shape == end.velocities.shape == (copies, 8, 2)


def test_ensemble_snapshot_and_chunks(body, w_bias, drive):
    ensemble = Ensemble(body, copies=3, threads=2, w_out=w_bias, feedback_delay=1)
    ensemble.set_state(velocities=np.random.default_rng(0).normal(size=(3, 8, 2)))
    snapshot = ensemble.snapshot()
    whole = ensemble.rollout(**drive, record=ALL)
    ensemble.restore(snapshot)
    chunks = list(ensemble.stream(**drive, record=ALL, chunk=41))
    assert same_bits(join(chunks), whole)


def test_ensemble_hook_beside_forces_of_every_copy(body):
    forces = np.random.default_rng(0).normal(size=(2, 5, 8))
    push = np.linspace(-1, 1, 8)
    run = Ensemble(body, copies=2).rollout(
        forces=forces, hook=lambda time, lengths: push, record=ALL
    )
    wanted = Ensemble(body, copies=2).rollout(forces=forces + push, record=ALL)
    assert same_bits(run, wanted)


@pytest.mark.parametrize(
    ("name", "value"),
    [("copies", 0), ("threads", 0), ("copies", 1.5), ("w_out", np.zeros((2, 16, 2)))],
)
def test_wrong_ensembles_are_named(body, name, value):
    with pytest.raises(InvalidArgumentError) as caught:
        Ensemble(body, **{"copies": 3, name: value})
    assert caught.value.name == name
