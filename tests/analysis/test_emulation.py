"""Springs that static feedback makes other systems, against exact solutions and DOP853."""

import numpy as np
import pytest
import sympy as sp
from scipy.linalg import expm

import mcmj
from mcmj.analysis.emulation import (
    coupled_feedback,
    emulation_body,
    lift,
    scalar_function,
    static_feedback,
)
from mcmj.analysis.spring_arrays import WALL, LinearArray, diverse_array, numerical_rank
from mcmj.core.callbacks.coupled_laws import CoupledLaw
from mcmj.core.integrators import INTEGRATORS
from mcmj.experiments.emulate.run import Config, emulate, emulation_error, reference, run
from mcmj.experiments.emulate.systems import single, system
from mcmj.reference.integration import integrate
from mcmj.simulation.stepsize.limit import stability_limit
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError

ORDERS = {name: row.order for name, row in INTEGRATORS.items() if not row.implicit}


@pytest.mark.parametrize("integrator", ["Euler", "leapfrog", "RK4", "implicit", "discrete"])
def test_an_oscillator_becomes_another_one(integrator):
    """x'' = -4 x, exactly cos 2 t; the spring itself would hardly move."""
    one = single("stiffer", lambda x1, x2: -4.0 * x1, (1.0, 0.0))
    states = emulate(one, integrator, 1.0, 3.0)
    times = 1e-3 * np.arange(len(states))
    wanted = np.column_stack([np.cos(2 * times), -2 * np.sin(2 * times)])
    error = emulation_error(states, wanted)
    tolerance = {"leapfrog": 3e-6, "RK4": 5e-12}.get(integrator, 3e-3)
    assert error < tolerance


@pytest.mark.parametrize("name", ["van_der_pol", "generator_duffing", "lorenz"])
@pytest.mark.parametrize("integrator", ORDERS)
def test_the_order_is_the_integrators(name, integrator):
    """Of one mass, and of several under one coupled law, halving the step twice."""
    one, steps = system(name), (8.0, 4.0, 2.0)
    errors = [
        emulation_error(emulate(one, integrator, h, 4.0), reference(one, h, 4.0)) for h in steps
    ]
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(ORDERS[integrator], abs=0.2)


def test_a_held_input_costs_order_two_in_the_middle_and_one_at_the_start():
    one, steps = system("driven_duffing"), (8.0, 4.0, 2.0)
    for sample_at, order in ((0.5, 2.0), (0.0, 1.0)):
        errors = [
            emulation_error(
                emulate(one, "RK4", h, 4.0, sample_at=sample_at), reference(one, h, 4.0)
            )
            for h in steps
        ]
        assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(order, abs=0.1)


def test_k_sharp_makes_the_double_integrator():
    """x'' = u: under a constant force RK4 gives u t^2 / 2 to rounding."""
    law = static_feedback("nothing", lambda x1, x2: 0.0 * x1)
    sim = mcmj.Simulation(emulation_body(), springs=law, integrator="RK4")
    lengths = sim.rollout(inputs=np.full((2000, 1), 0.3)).lengths
    times = 1e-3 * np.arange(2000)
    assert np.abs(lengths[:, 0] - WALL - 0.15 * times**2).max() < 1e-11


def test_without_feedback_it_is_the_passive_body():
    """K = 0 leaves p + q: the same motion as native springs, to rounding."""

    def nothing(x1, x2, parameters, out):
        for i in range(len(x1)):
            k1, k3, d1, d3 = parameters[i]
            out[i] = x1[i] * (k1 + k3 * x1[i] ** 2) + x2[i] * (d1 + d3 * x2[i] ** 2)

    body = emulation_body(3)
    inputs = 5 * np.sin(3e-3 * np.arange(1500))[:, None]
    for integrator in ("Euler", "RK4", "leapfrog"):
        one, other = (
            mcmj.Simulation(body, springs=springs, integrator=integrator).rollout(inputs=inputs)
            for springs in ("native", CoupledLaw("passive", nothing))
        )
        assert np.ptp(one.lengths, axis=0).min() > 0.05
        assert np.abs(one.lengths - other.lengths).max() < 2e-12


def test_a_coupled_law_in_a_plane_network(body, w_out):
    """Springs in all directions, a closed loop: as the cubic law, spring by spring."""

    def cubic(x1, x2, parameters, out):
        for i in range(len(x1)):
            k1, k3, d1, d3 = parameters[i]
            out[i] = x1[i] * (k1 + k3 * x1[i] ** 2) + x2[i] * (d1 + d3 * x2[i] ** 2)

    forces = np.linspace(-20, 20, body.n_nodes)
    one, other = (
        mcmj.Simulation(body, w_out=w_out, springs=springs).rollout(500, forces=forces)
        for springs in ("cubic", CoupledLaw("all_cubic", cubic))
    )
    assert np.ptp(one.lengths, axis=0).max() > 0.3
    assert np.abs(one.lengths - other.lengths).max() < 2e-12


def test_a_body_file_keeps_a_coupled_body():
    law = coupled_feedback("free", lambda x, v, out: None)
    body = emulation_body(2)
    read, _ = mcmj.from_mjcf(mcmj.to_mjcf(body, springs=law))
    assert read == body


def test_a_lifted_system_comes_back_to_its_flow():
    """Started off x' = F(x) by e, x' - F decays as e exp(-c t): x' = -x, so x'' = -x' - c(x'+x)."""
    x = sp.Symbol("x")
    law = coupled_feedback("decay", lift([x], [-x], contraction=5.0))
    body = emulation_body(1)
    sim = mcmj.Simulation(body, springs=law, integrator="RK4")
    positions, velocities = body.positions.copy(), np.zeros((2, 2))
    positions[1, 0] += 1.0
    velocities[1, 0] = -1.0 + 0.5
    sim.set_state(positions, velocities)
    ran = sim.rollout(2000, record=("lengths", "velocities"))
    off = ran.velocities[:, 1, 0] + (ran.lengths[:, 0] - WALL)
    assert np.abs(off - 0.5 * np.exp(-5e-3 * np.arange(2000))).max() < 1e-11


def test_run_reports_orders_and_a_target_of_the_users():
    config = Config(
        targets=("pendulum",), g="-x1 - x2**3 / 2", integrators=("Euler", "RK4"),
        steps_ms=(1.0, 2.0, 4.0, 8.0), horizon=2.0, mismatches=(1e-4,),
    )  # fmt: skip
    table = run(config).metrics
    for target in ("pendulum", "user"):
        assert table[target]["Euler"]["order"] == pytest.approx(1.0, abs=0.05)
        assert table[target]["RK4"]["error"] < 1e-11 < 1e-5 < table[target]["Euler"]["error"]
    assert 1e-4 < table["mismatch"]["0.0001"] < 1.0


def test_wrong_arguments():
    x, y = sp.symbols("x y")
    with pytest.raises(InvalidArgumentError, match="g: expected an expression in x1, x2"):
        scalar_function("x1 + foo * 2")
    with pytest.raises(InvalidArgumentError, match="g: expected an expression"):
        scalar_function("x1 +* 2")
    with pytest.raises(InvalidArgumentError, match="rates: expected 1 expressions"):
        lift([x], [x * y])
    with pytest.raises(UnknownNameError, match="unknown target 'waltz'"):
        Config(targets=("waltz",))
    with pytest.raises(InvalidArgumentError, match="divisors of the horizon"):
        Config(steps_ms=(1.0, 3.0))
    with pytest.raises(InvalidArgumentError, match="a law of one spring at a time"):
        stability_limit(
            emulation_body(), "Euler", springs=coupled_feedback("c", lambda x, v, out: None)
        )


# --- arrays ------------------------------------------------------------------------------------


def test_an_array_in_mujoco_is_its_state_space():
    """Held inputs: exactly x_(k+1) = e^(A h) x_k + ..., which DOP853 gives; RK4 to its error."""
    array = LinearArray([40.0, 90.0, 200.0], [2.0, 3.0, 1.0])
    body, inputs = array.body(), np.random.default_rng(0).normal(size=(400, 1))
    lengths = mcmj.Simulation(body, integrator="RK4").rollout(inputs=inputs).lengths
    a, b = array.state_space()
    augmented = expm(np.block([[a, b[:, None]], [np.zeros((1, 7))]]) * 1e-3)
    z, exact = np.zeros(7), []
    for u in inputs[:, 0]:
        exact.append(z[0:6:2].copy())
        z[6] = u
        z = augmented @ z
    assert np.abs(lengths - body.rest_lengths - exact).max() < 1e-11
    assert np.ptp(exact, axis=0).min() > 1e-3
    precise = integrate(body, method="dop853", inputs=inputs[:100]).lengths
    assert np.abs(precise - lengths[:100]).max() < 1e-11


@pytest.mark.parametrize("masses", [2, 3, 5])
def test_equal_springs_reach_two_states_only(masses):
    diverse = diverse_array(masses, 1.0, stiffness=100.0, damping=2.0)
    equal = diverse_array(masses, 0.0, stiffness=100.0, damping=2.0)
    assert numerical_rank(diverse.controllability()) == 2 * masses
    assert numerical_rank(equal.controllability()) == 2


def test_conditioning_grows_as_a_power_of_the_diversity():
    """n springs: cond R ~ diversity^-(n - 1)."""
    for n in (2, 3, 4):
        conditions = [
            np.linalg.cond(diverse_array(n, s, stiffness=100.0, damping=2.0).controllability())
            for s in (1e-2, 1e-3)
        ]
        assert np.log10(conditions[1] / conditions[0]) == pytest.approx(n - 1, abs=0.05)
