"""The table of integrators: each row says the truth, and the other lists follow from it."""

import mujoco
import numpy as np
import pytest
from scipy.linalg import expm

import mcmj
from mcmj.core.integrators import INTEGRATORS, TWINNED, TWINS, integrator_named
from mcmj.core.options import Options
from mcmj.core.trajectory import State
from mcmj.mjcf.write import to_mjcf
from mcmj.reference.integration import METHODS, integrate
from mcmj.simulation.simulation import Simulation
from mcmj.simulation.stepsize.linearisation import linear_system
from mcmj.simulation.stepsize.schemes import step_map
from mcmj.utils.errors import UnknownNameError


def test_a_row_runs_every_integrator_of_mujoco_and_no_other():
    numbers = mujoco.mjtIntegrator.__members__
    for name, row in INTEGRATORS.items():
        assert row.name == name
        model = mujoco.MjModel.from_xml_string(
            f"<mujoco><option integrator='{row.mujoco_name}'/></mujoco>"
        )
        assert model.opt.integrator == numbers[f"mjINT_{row.mujoco_name.upper()}"].value
    run = {f"mjINT_{row.mujoco_name.upper()}" for row in INTEGRATORS.values()}
    assert run == set(numbers)


@pytest.mark.parametrize("name", INTEGRATORS)
def test_files_keep_the_integrator(body, name):
    model = mcmj.mjcf.read.load_model(to_mjcf(body, integrator=name))
    assert mcmj.mjcf.kept.settings_of_model(model)["integrator"] == name


@pytest.mark.parametrize("name", INTEGRATORS)
def test_the_order_is_that_of_the_error_after_a_time(name):
    """Of the linearised body with light dampers, against the matrix exponential."""
    body = mcmj.random_body(1, nodes=6, k1=(1, 2), d1=(0.01, 0.02))
    system, n = linear_system(body), 2 * len(body.free)
    inverse = np.diag(1.0 / system.masses)
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.eye(n)
    A[n:, :n] = -inverse @ system.stiffness.toarray()
    A[n:, n:] = -inverse @ system.damping.toarray()
    start, steps = np.random.default_rng(0).standard_normal(2 * n), np.array([40, 80, 160])
    errors = []
    for count in steps:
        h = 1.0 / count
        state = start
        if name == "leapfrog":  # its velocities are those half a step back, at both ends
            back = expm(-0.5 * h * A) @ start
            state = np.concatenate([start[:n], back[n:], (expm(-1.5 * h * A) @ start)[n:]])
        state = np.linalg.matrix_power(step_map(system, name, h), count) @ state
        errors.append(np.linalg.norm(state[:n] - (expm(A) @ start)[:n]))
    slope = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(INTEGRATORS[name].order, abs=0.1)


@pytest.mark.parametrize("name", [name for name, row in INTEGRATORS.items() if row.twin])
def test_a_twin_takes_the_steps_of_its_row(body, name):
    kick = np.random.default_rng(0).normal(size=(body.n_nodes, 2))
    kick[body.fixed] = 0.0
    simulation = Simulation(body, integrator=name)
    simulation.set_state(velocities=kick)
    run = simulation.rollout(50, record=("lengths",))
    twin = integrate(
        body, method=TWINNED[name].twin, steps=50, initial_state=State(body.positions, kick)
    )
    assert np.abs(run.lengths - twin.lengths).max() < 1e-12
    assert np.ptp(run.lengths, axis=0).max() > 1e-2  # it moves


def test_all_twins_are_methods_of_the_reference():
    assert set(METHODS) == {"dop853", *TWINS, "toolbox_euler", "toolbox_rk"}


def test_options_check_the_integrator():
    for engine, known in (("mujoco", INTEGRATORS), ("twin", TWINNED)):
        for name in known:
            assert Options(integrator=name, engine=engine).integrator == name
        with pytest.raises(UnknownNameError) as caught:
            Options(integrator="midpoint", engine=engine)
        assert caught.value.choices == sorted(known)
    with pytest.raises(UnknownNameError, match=r"integrator of the twin 'discrete'; valid"):
        Options(integrator="discrete", engine="twin")


def test_a_name_finds_its_row():
    assert integrator_named("RK4") is INTEGRATORS["RK4"]
    assert integrator_named("rk4", TWINS) is INTEGRATORS["RK4"]
    with pytest.raises(UnknownNameError, match="unknown integrator 'rk4'; valid choices: Euler, "):
        integrator_named("rk4")
