"""Bodies in space in MuJoCo, against the planar ones, DOP853 and plain NumPy."""

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
from rollouts import ALL
from spatial import drive, kicked, lifted, random_turn, readout, space_body, turned

import mcmj
from mcmj.core.integrators import INTEGRATORS
from mcmj.core.trajectory import State
from mcmj.metrics.orbits import orbit_error
from mcmj.reference.integration import integrate
from mcmj.simulation.interactive import LiveLoop
from mcmj.simulation.phases import Phase, Schedule
from mcmj.simulation.run_phases import run_schedule
from mcmj.simulation.stepsize.limit import recommend, stability_limit
from mcmj.simulation.trajectory_files.npz import load_trajectory, save_trajectory
from mcmj.utils.errors import (
    DivergenceError,
    InvalidArgumentError,
    StabilityWarning,
    TrajectoryFileError,
)

T = 200


def run(body, start, w_out=None, steps=T, **options):
    simulation = mcmj.Simulation(body, w_out=w_out, **options)
    simulation.set_state(start.positions, start.velocities)
    return simulation.rollout(record=ALL, **drive(body, steps))


def planar():
    return mcmj.random_body(1, 10, width=1.0, height=1.0, n_inputs=1)


@pytest.mark.parametrize(
    ("integrator", "springs"),
    [*((name, "native") for name in INTEGRATORS), ("leapfrog", "cubic"), ("RK4", "tansig")],
)
def test_in_the_plane_as_planar_also_when_turned(integrator, springs):
    body = planar()
    start, w_out = kicked(body), readout(body)
    # not at rest lengths: there MuJoCo's discrete takes a spring's stiffness for 0, if exactly
    start = replace(start, positions=start.positions + 0.02 * start.velocities)
    raised, matrices = lifted(body), [np.eye(3)]
    if integrator != "implicitfast":  # it couples no coordinates, whichever they are
        matrices.append(random_turn(6))
    # turned in the plane, too, the equations that discrete solves differ by 5e-11 m after 0.2 s
    limit = 5e-10 if integrator == "discrete" else 1e-14  # others 2e-15
    flat = run(body, start, w_out, integrator=integrator, springs=springs)
    for matrix in matrices:
        other, rows = turned(raised, matrix), (start.positions, start.velocities)
        upright = State(*(np.column_stack([row, np.zeros(10)]) @ matrix.T for row in rows))
        again = run(other, upright, w_out, integrator=integrator, springs=springs)
        assert again.positions.shape == (T, 10, 3)
        for name in ("positions", "velocities"):
            found = getattr(again, name) @ matrix
            assert np.abs(found[..., :2] - getattr(flat, name)).max() < limit
            assert np.abs(found[..., 2]).max() < limit
        assert np.abs(again.lengths - flat.lengths).max() < limit
        assert np.abs(again.outputs - flat.outputs).max() < limit
    assert np.ptp(flat.lengths, axis=0).max() > 1e-3


TWINS = {"Euler": "semi_implicit_euler", "RK4": "rk4", "leapfrog": "leapfrog"}


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("integrator", TWINS)
def test_mujoco_is_plain_numpy(integrator, dimensions):
    body = space_body(n_inputs=1)
    if dimensions == 2:
        body = replace(planar(), direction=[3.0, 4.0])
    w_out, start = readout(body), kicked(body)
    one = run(body, start, w_out, integrator=integrator)
    method = {"method": TWINS[integrator], "w_out": w_out}
    other = integrate(body, initial_state=start, **method, **drive(body, T))
    assert np.abs(one.lengths - other.lengths).max() < 1e-14  # measured 2e-15
    assert np.abs(one.outputs - other.outputs).max() < 2e-14  # 2e-15
    state, exact = one.final_state, other.final_state
    assert np.abs(state.positions - exact.positions).max() < 1e-14  # 1e-15
    assert np.abs(state.velocities - exact.velocities).max() < 1e-14  # 1e-15


@pytest.mark.parametrize(
    ("integrator", "order"),
    [("Euler", 1), ("discrete", 1), ("implicit", 1), ("leapfrog", 2), ("RK4", 4)],
)
def test_order_of_convergence_against_dop853(integrator, order):
    body = space_body()
    start = kicked(body, speed=0.1)
    push = {"forces": 3.0 * np.arange(body.n_nodes) % 5 - 2.0}
    exact = integrate(
        body, method="dop853", steps=1, timestep=0.2, initial_state=start, **push
    ).final_state
    errors = []
    for step in (1e-3, 5e-4, 2.5e-4):
        simulation = mcmj.Simulation(body, integrator=integrator, timestep=step)
        simulation.set_state(start.positions, start.velocities)
        simulation.rollout(round(0.2 / step), **push)
        errors.append(np.abs(simulation.state.positions - exact.positions).max())
    slopes = -np.diff(np.log2(errors))
    assert np.all(np.abs(slopes - order) < 0.2), slopes


def test_a_turned_body_has_the_same_lengths():
    body, turn = space_body(n_inputs=1), random_turn(7)
    start, w_out = kicked(body), readout(body)
    around = replace(
        start, positions=start.positions @ turn.T, velocities=start.velocities @ turn.T
    )
    one, other = run(body, start, w_out), run(turned(body, turn), around, w_out)
    assert np.abs(one.lengths - other.lengths).max() < 3e-15  # measured 3e-16


def test_a_law_of_your_own_and_its_slopes():
    def pull(x1, x2, k1, k3, d1, d3):
        return x1 * (k1 + k3 * x1 * x1) + x2 * (d1 + d3 * x2 * x2)

    body = space_body(n_inputs=1)
    start, law = kicked(body), mcmj.SpringLaw("own_in_space", pull)
    one, other = run(body, start), run(body, start, springs=law)
    assert np.abs(one.positions - other.positions).max() < 1e-15  # measured 1e-16


def test_ensemble_snapshot_and_state():
    body = space_body(n_inputs=1)
    w_out, start = readout(body), kicked(body)
    given = drive(body, T)
    single = mcmj.Simulation(body, w_out=w_out)
    single.set_state(start.positions, start.velocities)
    ensemble = mcmj.Ensemble(body, copies=3, threads=2, w_out=np.stack([w_out, 0 * w_out, w_out]))
    ensemble.set_state(start.positions, np.tile(start.velocities, (3, 1, 1)))
    assert ensemble.state.velocities.shape == (3, body.n_nodes, 3)
    one, many = single.rollout(record=ALL, **given), ensemble.rollout(record=ALL, **given)
    assert many.positions.shape == (3, T, body.n_nodes, 3)
    for copy in (0, 2):
        assert many.positions[copy].tobytes() == one.positions.tobytes()
        assert many.velocities[copy].tobytes() == one.velocities.tobytes()
    assert not np.array_equal(many.lengths[1], one.lengths)
    kept = single.snapshot()
    after = single.rollout(50, record=ALL)
    single.rollout(50)
    single.restore(kept)
    again = single.rollout(50, record=ALL)
    assert after.velocities.tobytes() == again.velocities.tobytes()
    other = mcmj.Simulation(replace(body, direction=[0, 0, 1]), w_out=w_out)
    with pytest.raises(InvalidArgumentError, match=r"^snapshot: "):
        other.restore(kept)
    with pytest.raises(InvalidArgumentError, match=r"^positions: expected shape \(12, 3\)"):
        single.set_state(body.positions[:, :2])


def test_cut_springs_and_changed_masses_are_those_of_another_body():
    """A spring cut is one with next to no force."""
    body, cut = space_body(n_inputs=1), [0, 5]
    masses = body.masses[::-1].copy()
    weak = np.ones(body.n_springs)
    weak[cut] = 1e-300
    scaled = {name: getattr(body, name) * weak for name in ("k1", "k3", "d1", "d3")}
    wanted = run(replace(body, masses=masses, **scaled), kicked(body))
    simulation = mcmj.Simulation(body)
    simulation.alter(cut=cut, masses=masses)
    simulation.set_state(velocities=kicked(body).velocities)
    found = simulation.rollout(record=ALL, **drive(body, T))
    assert np.array_equal(found.positions, wanted.positions)


def test_forces_inputs_and_feedback_act_along_the_direction():
    """One free mass on springs that do next to nothing: a = F / m."""
    weak = np.full(3, 1e-12)
    body = mcmj.Body(
        np.vstack([np.zeros(3), np.eye(3)]), [[0, 1], [0, 2], [0, 3]], weak, 0 * weak, weak,
        0 * weak, fixed=[False, True, True, True], w_in=[[2.0], [0], [0], [0]],
        w_fb=[[3.0], [0], [0], [0]], masses=np.full(4, 4.0), direction=[1, 2, 2],
    )  # fmt: skip
    steps, one = 100, np.ones((100, 1))
    for force, given in (
        (1.0, {"forces": np.ones(4)}),
        (1.0, {"forces": np.ones((100, 4))}),
        (2.0, {"inputs": one}),
        (3.0, {"offset": one}),
        (6.0, {"forces": np.ones(4), "inputs": one, "offset": one}),
    ):
        state = mcmj.Simulation(body).rollout(steps, **given).final_state
        wanted = force / 4.0 * 0.1 * np.array([1, 2, 2]) / 3
        assert state.velocities[0] == pytest.approx(wanted, rel=1e-10)


def test_a_blow_up_says_the_speed_in_space():
    body = space_body()
    simulation = mcmj.Simulation(body)
    with pytest.raises(DivergenceError, match=r"at node \d+ \(speed \S+ m/s\), integrator leap"):
        simulation.rollout(2000, forces=np.full(body.n_nodes, 1e9))


def test_step_limits_are_where_mujoco_grows():
    body = space_body(k3=(0, 0), d3=(0, 0))
    for integrator in ("Euler", "leapfrog", "RK4"):
        limit = stability_limit(body, integrator)
        grown = []
        for step in (0.99 * limit, 1.01 * limit):
            with pytest.warns(StabilityWarning) if step > limit else nullcontext():
                simulation = mcmj.Simulation(body, integrator=integrator, timestep=step)
            simulation.set_state(velocities=1e-9 * kicked(body).velocities)
            try:
                simulation.rollout(3000)
                grown.append(np.abs(simulation.state.velocities).max() > 1e-9)
            except DivergenceError:
                grown.append(True)
        assert grown == [False, True], integrator
    assert recommend(body, 1.0).substeps > 1


def test_what_is_planar_only_says_so():
    body = space_body()
    for call in (
        lambda: mcmj.Simulation(body, engine="twin"),
        lambda: mcmj.Ensemble(body, copies=4, engine="twin"),
        lambda: mcmj.Simulation(replace(planar(), direction=[0, 1]), engine="twin"),
    ):
        with pytest.raises(InvalidArgumentError, match="for the compiled twins") as caught:
            call()
        assert caught.value.name == "body"


def test_a_body_in_space_learns():
    """Ranges as in the plane: 25 to 40 nodes, seeds 0 to 2, all below 0.12 per cent."""
    body, goal = mcmj.random_body(0, depth=100.0), mcmj.target("van_der_pol")
    simulation = mcmj.Simulation(body)
    mcmj.teach(simulation, goal, mcmj.Teaching(), seed=0)
    free = simulation.rollout(60_000, record=("outputs",)).outputs
    assert orbit_error(free, goal) < 0.003  # measured 0.0005


def test_the_body_of_the_viewer_is_pushed_and_kicked_in_space():
    body = space_body()
    loop = LiveLoop(mcmj.Simulation(body), {"one": 0 * readout(body)})
    push = np.zeros((loop.model.nbody, 6))
    push[loop.model.body(f"n{body.free[0]}").id, 2] = 1.0
    loop.advance(1, push)
    wanted = np.zeros((len(body.free), 3))
    wanted[0, 2] = 1e-6 / body.masses[body.free[0]]
    assert np.abs(loop.data.qpos.reshape(-1, 3) - wanted).max() < 1e-15
    loop.kick(0.2, np.random.default_rng(0))
    loop.advance(10)
    assert (np.ptp(loop.data.qpos.reshape(-1, 3), axis=0) > 1e-4).all()
    assert loop.alive


def test_a_schedule_pushes_along_the_direction():
    body = space_body()
    schedule = Schedule([Phase(0.05, forces=np.ones(body.n_nodes)), Phase(0.05)])
    phases = run_schedule(mcmj.Simulation(body), schedule, 0, record=("lengths",))
    forces = np.repeat([[1.0], [0.0]], 50, axis=0) * np.ones(body.n_nodes)
    wanted = mcmj.Simulation(body).rollout(forces=forces)
    assert np.array_equal(phases.trajectory.lengths, wanted.lengths)


@pytest.mark.parametrize("suffix", ["npz", "zarr"])
def test_a_trajectory_in_space_is_kept(tmp_path, suffix):
    body = space_body(n_inputs=1)
    kept = run(body, kicked(body), steps=20)
    path = tmp_path / f"run.{suffix}"
    if suffix == "zarr":
        pytest.importorskip("zarr")
    save_trajectory(path, kept, body=body)
    again = load_trajectory(path)
    assert again.body == body
    assert np.array_equal(again.trajectory.positions, kept.positions)
    assert np.array_equal(again.trajectory.velocities, kept.velocities)


def test_positions_and_velocities_are_in_one_space_which_is_the_bodys(tmp_path):
    flat, path = planar(), tmp_path / "run.npz"
    kept = run(flat, kicked(flat), steps=20)
    raised = np.concatenate([kept.positions, kept.positions[..., :1]], axis=-1)
    moved = replace(kept, positions=raised)
    save_trajectory(path, moved)
    with pytest.raises(TrajectoryFileError, match="in one space"):
        load_trajectory(path)
    save_trajectory(path, replace(moved, velocities=raised), body=flat)
    with pytest.raises(TrajectoryFileError, match="positions: expected 2 columns"):
        load_trajectory(path)
