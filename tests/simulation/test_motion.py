"""How bodies move: exact solutions, an energy balance, symmetries."""

import numpy as np
import pytest
from rollouts import ALL, changed, exact_oscillator

import mcmj
from mcmj import Body, Simulation
from mcmj.core.integrators import INTEGRATORS


def oscillator_error(body, integrator, timestep, force=0.0):
    steps = round(2.0 / timestep)
    run = Simulation(body, integrator=integrator, timestep=timestep).rollout(
        steps, forces=[0.0, force], record=("lengths", "positions", "velocities")
    )
    exact = exact_oscillator(body, run.times, force)
    assert np.abs(run.positions[:, 1, 1]).max() == 0.0
    return max(
        np.abs(run.lengths[:, 0] - 1.0 - exact[:, 0]).max(),
        np.abs(run.velocities[:, 1, 0] - exact[:, 1]).max(),
    )


@pytest.mark.parametrize(("integrator", "order"), [("Euler", 1), ("RK4", 4), ("implicit", 1)])
@pytest.mark.parametrize("force", [0.0, 3.0])
def test_oscillator_converges_to_the_exact_solution(oscillator, integrator, order, force):
    steps = [0.04, 0.02, 0.01]
    errors = [oscillator_error(oscillator, integrator, h, force) for h in steps]
    orders = np.log2(errors[:-1]) - np.log2(errors[1:])
    assert orders == pytest.approx([order] * 2, abs=0.12)
    assert errors[-1] < (0.04 if order == 1 else 2e-8)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_oscillator_under_every_integrator(oscillator, integrator):
    assert oscillator_error(oscillator, integrator, 1e-3) < 5e-3


def test_constant_force_ends_in_equilibrium(oscillator):
    """k1 x = F once all has come to rest."""
    simulation = Simulation(oscillator, integrator="RK4", timestep=0.02)
    rest = simulation.rollout(5000, forces=[0.0, 4.5]).lengths[-1]
    assert rest == pytest.approx([1.0 + 4.5 / 9.0], abs=1e-12)


def test_energy_balance():
    """Loss of kinetic and elastic energy = work of the dampers, for the full nonlinear body."""
    body = mcmj.random_body(4, nodes=10, k1=(5.0, 50.0))
    simulation = Simulation(body, integrator="RK4", timestep=1e-4)
    rng = np.random.default_rng(0)
    simulation.set_state(velocities=0.3 * rng.normal(size=(10, 2)))
    run = simulation.rollout(4001, record=("lengths", "positions", "velocities"))
    a, b = body.springs.T
    axis = (run.positions[:, b] - run.positions[:, a]) / run.lengths[..., None]
    rate = ((run.velocities[:, b] - run.velocities[:, a]) * axis).sum(axis=-1)
    x = run.lengths - body.rest_lengths
    elastic = (body.k1 * x**2 / 2 + body.k3 * x**4 / 4).sum(axis=1)
    kinetic = (body.masses[:, None] * run.velocities**2).sum(axis=(1, 2)) / 2
    power = (body.d1 * rate**2 + body.d3 * rate**4).sum(axis=1)
    h = simulation.timestep
    work = h / 3 * (power[0] + 4 * power[1:-1:2].sum() + 2 * power[2:-2:2].sum() + power[-1])
    energy = elastic + kinetic
    assert energy[0] > 1.2 * energy[-1]
    assert energy[0] - energy[-1] == pytest.approx(work, rel=5e-8)
    assert (np.diff(energy) < 0).all()


@pytest.mark.parametrize("flip", [[1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])
def test_a_mirrored_body_moves_as_a_mirror_image(body, w_out, drive, flip):
    x = flip[0]
    mirror = changed(body, positions=body.positions * flip, w_in=x * body.w_in, w_fb=x * body.w_fb)
    image = drive | {"forces": x * drive["forces"]}
    run = Simulation(body, w_out=w_out).rollout(**drive, record=ALL)
    seen = Simulation(mirror, w_out=w_out).rollout(**image, record=ALL)
    assert np.abs(run.positions * flip - seen.positions).max() < 1e-12
    assert np.abs(run.lengths - seen.lengths).max() < 1e-12


def test_renumbered_nodes_and_springs_move_the_same(body, w_out, drive):
    rng = np.random.default_rng(0)
    nodes, springs = rng.permutation(body.n_nodes), rng.permutation(body.n_springs)
    per_node = {
        n: getattr(body, n)[nodes] for n in ("positions", "fixed", "w_in", "w_fb", "masses")
    }
    names = ("k1", "k3", "d1", "d3", "rest_lengths")
    per_spring = {n: getattr(body, n)[springs] for n in names}
    other = Body(
        springs=np.argsort(nodes)[body.springs[springs]][:, ::-1], **per_node, **per_spring
    )
    run = Simulation(body, w_out=w_out).rollout(**drive, record=ALL)
    seen = Simulation(other, w_out=w_out[springs]).rollout(
        **drive | {"forces": drive["forces"][:, nodes]}, record=ALL
    )
    assert np.abs(run.positions[:, nodes] - seen.positions).max() < 1e-12
    assert np.abs(run.outputs - seen.outputs).max() < 1e-13


def test_a_body_at_rest_stays_there(body):
    run = Simulation(body).rollout(1000, record=("positions",))
    assert np.abs(run.positions - body.positions).max() < 1e-12
