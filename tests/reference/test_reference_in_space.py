"""The references of bodies in space against the compiled twins, DOP853, energy and momentum."""

from dataclasses import replace

import numpy as np
import pytest
from spatial import drive, kicked, lifted, random_turn, readout, space_body, turned

import mcmj
from mcmj.core.body import spring_lengths
from mcmj.core.trajectory import State
from mcmj.reference.integration import METHODS, integrate, integrate_smooth
from mcmj.utils.errors import DivergenceError, InvalidArgumentError

FIXED_STEP = METHODS[1:]
SAME = 3e-15  # m, m/s; measured 3e-16, 9e-16


def planar():
    return mcmj.random_body(1, 10, width=1.0, height=1.0, n_inputs=1)


def flat(state):
    """The planar state of one in the plane z = 0."""
    past = state.history
    if past is not None:
        past = np.delete(past, [2, 5, 8], axis=1)
    return replace(
        state, positions=state.positions[:, :2], velocities=state.velocities[:, :2], history=past
    )


@pytest.mark.parametrize("method", METHODS)
def test_a_body_in_the_plane_moves_as_the_planar_one(method):
    """Plain NumPy against the compiled twins; a second run goes on from the first's end."""
    steps = 20 if method == "dop853" else 200
    body, how = planar(), {"method": method}
    raised, w_out, start = lifted(body), readout(body), kicked(body)
    upright = State(
        *(np.column_stack([a, np.zeros(10)]) for a in (start.positions, start.velocities))
    )
    for part in range(2):
        run = {**how, "w_out": w_out, **drive(body, steps, seed=part)}
        one = integrate(body, initial_state=start, **run)
        other = integrate(raised, initial_state=upright, **run)
        start, upright = one.final_state, other.final_state
        assert np.abs(one.lengths - other.lengths).max() < SAME
        assert np.abs(start.velocities - upright.velocities[:, :2]).max() < 2 * SAME
        assert not upright.positions[:, 2].any()
    if method != "dop853":
        crossed = integrate(body, initial_state=flat(upright), **run)
        same = integrate(body, initial_state=start, **run)
        assert np.abs(crossed.lengths - same.lengths).max() < SAME
    assert np.ptp(one.lengths, axis=0).max() > 1e-3


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("method", ["dop853", "leapfrog", "toolbox_rk"])
def test_turned_with_its_direction_a_body_has_the_same_lengths(method, dimensions):
    body = space_body(n_inputs=1) if dimensions == 3 else planar()
    turn, start, w_out = random_turn(5, dimensions), kicked(body), readout(body)
    around = State(start.positions @ turn.T, start.velocities @ turn.T)
    run = {"method": method, "w_out": w_out, **drive(body, 60)}
    one = integrate(body, initial_state=start, **run)
    other = integrate(turned(body, turn), initial_state=around, **run)
    assert np.abs(one.lengths - other.lengths).max() < 1e-14  # measured 1e-15
    assert np.ptp(one.lengths, axis=0).max() > 1e-3


@pytest.mark.parametrize(
    ("method", "order"),
    [("semi_implicit_euler", 1), ("toolbox_euler", 1), ("rk4", 4), ("leapfrog", 2)],
)
def test_order_of_convergence(method, order):
    body = space_body()
    run = {
        "forces": 3 * np.arange(body.n_nodes) % 5 - 2.0,
        "initial_state": kicked(body, speed=0.1),
    }
    exact = integrate(body, method="dop853", steps=1, timestep=0.2, **run).final_state.positions
    errors = []
    for step in (1e-3, 5e-4, 2.5e-4):
        end = integrate(body, method=method, steps=round(0.2 / step), timestep=step, **run)
        errors.append(np.abs(end.final_state.positions - exact).max())
    slopes = -np.diff(np.log2(errors))
    assert np.all(np.abs(slopes - order) < 0.2), slopes


def undamped(body):
    """Dampers of next to no strength: a Body has none of strength 0."""
    return replace(body, d1=np.full(body.n_springs, 1e-300), d3=np.zeros(body.n_springs))


def test_energy_without_dampers():
    body = undamped(space_body())
    start = kicked(body, speed=1.0)
    potentials, energies = [], []
    for steps in (0, 500, 1000):
        end = start
        if steps:
            run = {"method": "dop853", "steps": 1, "timestep": 1e-3 * steps}
            end = integrate(body, initial_state=start, **run).final_state
        x1 = spring_lengths(end.positions, body.springs) - body.rest_lengths
        potentials.append((body.k1 * x1**2 / 2 + body.k3 * x1**4 / 4).sum())
        moving = (body.masses[:, None] * end.velocities**2).sum() / 2
        energies.append(potentials[-1] + moving)
    assert np.ptp(potentials) > 0.1
    assert np.ptp(energies) < 7e-13 * energies[0]  # measured 7e-14


@pytest.mark.parametrize("method", METHODS)
def test_momenta_without_fixed_nodes(method):
    body = space_body()
    body = replace(body, fixed=np.zeros(body.n_nodes, bool))
    start = kicked(body)
    end = integrate(body, method=method, steps=50, initial_state=start).final_state
    one, other = (body.masses @ s.velocities for s in (start, end))
    assert np.abs(one - other).max() < 6e-15  # measured 7e-16
    assert np.abs(end.velocities - start.velocities).max() > 0.1
    if method == "dop853":
        spins = [body.masses @ np.cross(s.positions, s.velocities) for s in (start, end)]
        assert np.abs(spins[0] - spins[1]).max() < 3e-15  # measured 3e-16


def test_feedback_that_acts_continuously():
    body = space_body()
    run = {"steps": 20, "w_out": readout(body, 0.05), "initial_state": kicked(body)}
    smooth = integrate_smooth(body, **run)
    held = integrate(body, method="dop853", **run)
    assert 0 < np.abs(smooth.lengths - held.lengths).max() < 1e-4


@pytest.mark.parametrize("method", FIXED_STEP)
def test_a_body_that_blows_up_says_when_and_where(method):
    body = space_body()
    with pytest.raises(DivergenceError, match=f"at node [0-9]+, method {method}") as caught:
        integrate(body, method=method, steps=500, forces=np.full(body.n_nodes, 1e9))
    assert 0 < caught.value.steps_done < 500


def test_a_planar_state_is_not_one_in_space():
    body = space_body()
    flat_start = State(body.positions[:, :2], body.positions[:, :2])
    with pytest.raises(InvalidArgumentError, match=r"^initial_state\.positions: "):
        integrate(body, method="rk4", steps=1, initial_state=flat_start)
