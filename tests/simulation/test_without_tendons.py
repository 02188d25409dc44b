"""Springs that mcmj computes without MuJoCo's tendons, against the tendons of the body's file."""

import glob
import os
from ctypes import CDLL, c_void_p
from dataclasses import replace

import mujoco
import numpy as np
import pytest
import twins

import mcmj
from mcmj import Ensemble, Simulation
from mcmj.core.callbacks.coupled_laws import CoupledLaw
from mcmj.core.integrators import INTEGRATORS
from mcmj.utils.errors import BodyFileError, InvalidArgumentError
from mcmj.utils.quiet import untimed

RECORD = ("lengths", "outputs", "positions", "velocities")
SCHEMES = [row.name for row in INTEGRATORS.values() if not row.implicit]
T = 600


def spring_sum(x1, x2, parameters, out):
    mean = x1.sum() / x1.size
    for j in range(out.size):
        out[j] = parameters[j, 0] * (x1[j] + 0.1 * mean) + parameters[j, 2] * x2[j]


LAWS = ["native", "cubic", "tansig", CoupledLaw("spring_sum", spring_sum)]
BODIES = {"plane": {}, "space": {"depth": 100.0, "nodes": 10}}


def body_of(kind, springs="native"):
    body = mcmj.random_body(4, n_inputs=1, masses=(0.5, 2.0), **BODIES[kind])
    # of slope k1 k3, d1 d3, tansig springs are stiff
    soft = springs == "tansig"
    return replace(body, k3=body.k3 / 100, d3=body.d3 / 100) if soft else body


def readout_of(body):
    return 1e-3 * np.random.default_rng(5).normal(size=(body.n_springs + 1, body.n_outputs))


def drive_of(body, steps=T):
    rng = np.random.default_rng(6)
    shapes = {"offset": body.n_outputs, "inputs": body.n_inputs, "forces": body.n_nodes}
    drawn = {name: rng.normal(size=(steps, size)) for name, size in shapes.items()}
    return {"gate": np.array([0.7, -1.3]), **drawn}


def both(body, **options):
    w_out = readout_of(body)
    return [Simulation(body, w_out=w_out, engine=e, **options) for e in ("mujoco", "tendons")]


def distance(one, other, names=RECORD):
    return max(np.abs(getattr(one, name) - getattr(other, name)).max() for name in names)


@pytest.mark.parametrize("kind", BODIES)
@pytest.mark.parametrize("integrator", SCHEMES)
def test_ten_thousand_steps_as_with_tendons(kind, integrator):
    body = body_of(kind)
    ends = [one.rollout(**drive_of(body, 10_000), record=RECORD) for one in both(
        body, integrator=integrator
    )]  # fmt: skip
    assert np.ptp(ends[0].lengths, axis=0).max() > 0.1
    assert distance(*ends) < 2e-13  # measured: at most 4.3e-14, on lengths up to 100 m


@pytest.mark.parametrize("springs", LAWS, ids=lambda law: getattr(law, "name", law))
@pytest.mark.parametrize("integrator", SCHEMES)
def test_laws_cuts_and_masses_as_with_tendons(springs, integrator):
    body = body_of("plane", springs)
    ends = []
    for one in both(body, springs=springs, integrator=integrator):
        first = one.rollout(**drive_of(body), record=RECORD)
        one.alter(cut=[0, 7], masses=np.linspace(0.5, 2.0, body.n_nodes))
        ends.append((first, one.rollout(**drive_of(body), record=RECORD)))
    for parts in zip(*ends, strict=True):
        assert distance(*parts) < 2e-13


@pytest.mark.parametrize("integrator", ["Euler", "leapfrog"])
@pytest.mark.parametrize(("substeps", "delay"), [(1, 1), (1, 4), (3, 0), (3, 2)])
def test_memory_of_lengths_as_mujoco_s_delayed_sensors(integrator, substeps, delay):
    """Also over a change of the readout, and from a snapshot taken in between."""
    body = body_of("plane")
    ends = []
    for one in both(body, integrator=integrator, substeps=substeps, feedback_delay=delay):
        parts = [one.rollout(**drive_of(body, 50), record=RECORD)]
        one.set_readout(-2 * readout_of(body))
        middle = one.snapshot()
        parts += [one.rollout(**drive_of(body), record=RECORD)]
        one.reset()
        one.restore(middle)
        again = one.rollout(**drive_of(body), record=RECORD)
        assert distance(again, parts[1]) == 0.0
        ends.append(parts)
    for parts in zip(*ends, strict=True):
        assert distance(*parts) < 2e-13


def test_asking_for_lengths_between_steps_changes_nothing():
    body, options = body_of("plane"), {"feedback_delay": 2, "substeps": 2}
    whole = both(body, **options)[0].rollout(**drive_of(body, 40))
    one = both(body, **options)[0]
    for k in range(40):
        part = {n: v[k : k + 1] if n != "gate" else v for n, v in drive_of(body, 40).items()}
        assert np.array_equal(one.signals, one.signals)
        assert np.array_equal(one.rollout(**part).lengths[0], whole.lengths[k])


def test_nodes_at_one_place_pull_along_x_as_tendons_do():
    body = body_of("plane")
    ends = []
    for one in both(body):
        places = body.positions.copy()
        a, b = body.springs[0]
        free = a if not body.fixed[a] else b
        places[free] = places[b if free == a else a]
        one.set_state(positions=places)
        assert one.signals[0] == 0.0
        one.rollout(1)
        ends.append(one.state.velocities)
    assert np.abs(ends[0][free]).max() > 1.0
    assert ends[0] == pytest.approx(ends[1], rel=1e-14, abs=1e-14 * np.abs(ends[0]).max())


def test_copies_are_cut_alike():
    body = body_of("plane")
    alone = Simulation(body, w_out=readout_of(body))
    copies = alone.with_copies(3, threads=2)
    for one in (alone, copies):
        one.alter(cut=[1, 2])
    many, single = copies.rollout(**drive_of(body)), alone.rollout(**drive_of(body))
    for lengths in many.lengths:
        assert np.array_equal(lengths, single.lengths)
    ensemble = Ensemble(body, copies=2, w_out=readout_of(body))
    assert distance(
        Simulation(body, w_out=readout_of(body)).rollout(**drive_of(body)),
        type("One", (), {"lengths": ensemble.rollout(**drive_of(body)).lengths[1]}),
        names=("lengths",),
    ) == 0.0  # fmt: skip


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_tendons_where_derivatives_are_needed(body, integrator):
    own = Simulation(body, integrator=integrator).model
    springs = body.n_springs if INTEGRATORS[integrator].implicit else 0
    assert (own.ntendon > 0) == (springs > 0) == (own.nsite > 0)
    assert Simulation(body, integrator=integrator, engine="tendons").model.nsite == body.n_nodes


def test_a_simulation_with_tendons_is_the_same_at_its_start(body, w_out):
    simulation = Simulation(body, w_out=w_out, integrator="leapfrog", substeps=2)
    simulation.alter(cut=[3])
    other = simulation.with_tendons()
    assert other.model.ntendon > 0
    assert other.options == replace(simulation.options, engine="tendons")
    assert distance(*(one.rollout(200, record=RECORD) for one in (simulation, other))) < 2e-13
    with pytest.raises(InvalidArgumentError):
        Simulation(body, engine="twin").with_tendons()


def test_energy_is_that_of_a_body_without_dampers():
    """Potential of the springs and kinetic energy, under RK4; the potential from its formula."""
    body = mcmj.random_body(1, nodes=8)
    body = replace(body, d1=np.full(body.n_springs, 1e-12), d3=0 * body.d3)
    simulation = Simulation(body, integrator="RK4")
    start = np.random.default_rng(0).normal(size=body.positions.shape)
    simulation.set_state(velocities=0.3 * start)
    run = simulation.rollout(2000, record=("lengths", "velocities"))
    x = run.lengths - body.rest_lengths
    potential = (body.k1 * x**2 / 2 + body.k3 * x**4 / 4).sum(axis=1)
    kinetic = (body.masses[:, None] * run.velocities**2).sum(axis=(1, 2)) / 2
    assert np.ptp(potential) > 0.5 * kinetic[0]
    assert np.ptp(potential + kinetic) < 1e-11 * kinetic[0]


@pytest.mark.parametrize("kind", BODIES)
@pytest.mark.parametrize("integrator", SCHEMES)
def test_what_is_at_rest_stays_at_rest_to_the_bit(kind, integrator):
    body = body_of(kind)
    run = Simulation(body, integrator=integrator).rollout(500, record=("lengths", "positions"))
    assert np.array_equal(run.lengths, np.tile(body.rest_lengths, (500, 1)))
    assert np.array_equal(run.positions[-1], body.positions)


def test_lengths_follow_the_twin_in_plain_mj_step(body):
    """Whoever steps the model under the callbacks gets lengths before the step."""
    simulation = Simulation(body)
    data = mujoco.MjData(simulation.model)
    data.qvel[:] = np.linspace(-0.5, 0.5, simulation.model.nv)
    for _ in range(20):
        positions = body.positions.copy()
        positions[body.free] += data.qpos.reshape(-1, 2)
        mujoco.mj_step(simulation.model, data)
        assert np.abs(data.sensordata - twins.lengths_of(body, positions)).max() < 1e-13


def test_a_body_that_mujoco_does_not_compile_is_one_clear_error(body):
    light = replace(body, masses=1e-30 * body.masses)
    with pytest.raises(BodyFileError, match="MuJoCo cannot compile"):
        Simulation(light)


def test_the_clock_goes_on_after_a_run(body):
    library = CDLL(glob.glob(os.path.join(os.path.dirname(mujoco.__file__), "libmujoco.so*"))[0])
    before = c_void_p.in_dll(library, "mjcb_time").value
    with untimed(), untimed():
        assert c_void_p.in_dll(library, "mjcb_time").value != before
    Simulation(body).rollout(10)
    assert c_void_p.in_dll(library, "mjcb_time").value == before
