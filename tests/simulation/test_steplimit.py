import math
import time

import numpy as np
import pytest
from networks import network, readout, simulation

import mcmj
from mcmj.core.integrators import INTEGRATORS
from mcmj.core.options import Options
from mcmj.experiments.hard_cases.run import bisect
from mcmj.simulation.stepsize.limit import recommend, stability_limit, warn_if_unstable
from mcmj.utils.errors import InvalidArgumentError, McmjWarning, StabilityWarning, UnknownNameError

TINY = 1e-12  # damping of what should be undamped


def one_mass(k=4.0, d=TINY, mass=0.25, axis=(1.0, 0.0)):
    """A mass on one spring to a fixed node: omega = sqrt(k / m), z = d / (2 sqrt(k m))."""
    return mcmj.Body(
        positions=[(0.0, 0.0), axis],
        springs=[(0, 1)],
        k1=[k],
        k3=[0.0],
        d1=[d],
        d3=[0.0],
        fixed=np.array([True, False]),
        masses=[1.0, mass],
    )


@np.errstate(over="ignore")  # speeds of 1e300 m/s
def loses_stability(body, integrator, step, w_out=None, steps=2400):
    """Whether a motion of 1e-7 m/s grows; small enough for geometry and cubes not to matter."""
    sim = simulation(body, integrator, step, w_out)
    sim.set_state(velocities=1e-7 * np.random.default_rng(0).standard_normal((body.n_nodes, 2)))
    parts = []
    for _ in range(4):
        try:
            run = sim.rollout(steps // 4, record=("lengths", "velocities"))
        except mcmj.utils.errors.DivergenceError:
            return True
        parts.append(np.abs(run.velocities).max())
    return parts[3] > max(1.02 * parts[1], 1e-11) or max(parts) > 1e-3


# --- analytic ---------------------------------------------------------------------------------

OMEGA = 4.0


@pytest.mark.parametrize("integrator", ["Euler", "semi_implicit_euler", "implicit", "leapfrog"])
def test_undamped_limit_is_two_over_omega(integrator):
    assert stability_limit(one_mass(), integrator) == pytest.approx(2 / OMEGA, rel=1e-9)


def test_rk4_bears_two_root_two_on_the_imaginary_axis():
    assert stability_limit(one_mass(), "RK4") == pytest.approx(2 * math.sqrt(2) / OMEGA, rel=1e-6)


def test_discrete_bears_every_step():
    assert stability_limit(one_mass(d=3.0), "discrete") == math.inf


@pytest.mark.parametrize("z", [0.01, 0.1, 0.5, 1.0, 5.0])
def test_damped_limits(z):
    body = one_mass(d=2 * z * math.sqrt(4.0 * 0.25), axis=(0.6, 0.8))
    expected = {
        "Euler": 2 * (math.sqrt(1 + z * z) - z),
        "leapfrog": math.sqrt(16 * z * z + 4) - 4 * z,
        "implicit": 2 * (math.sqrt(1 + z * z) + z),
    }
    for integrator, limit in expected.items():
        assert stability_limit(body, integrator) * OMEGA == pytest.approx(limit, rel=1e-9)


@pytest.mark.parametrize("z", [0.01, 0.1, 0.5, 1.0, 5.0])
def test_rk4_along_the_damped_ray(z):
    root = -z + (1j * math.sqrt(1 - z * z) if z < 1 else -math.sqrt(z * z - 1))
    limit = stability_limit(one_mass(d=2 * z * math.sqrt(4.0 * 0.25)), "RK4") * OMEGA
    growth = [abs(sum((h * root) ** n / math.factorial(n) for n in range(5))) for h in
              (0.9999 * limit, limit, 1.0001 * limit)]  # fmt: skip
    assert growth[0] < 1 < growth[2]
    assert growth[1] == pytest.approx(1, abs=1e-9)
    if z == 1.0:
        assert limit == pytest.approx(2.785293, rel=1e-5)


def test_growth_with_amplitude():
    body = mcmj.Body([(0, 0), (1, 0)], [(0, 1)], [4.0], [100.0], [TINY], [0.0],
                     fixed=np.array([True, False]))  # fmt: skip
    tangent, secant = 4 + 3 * 100 * 0.1**2, 4 + 100 * 0.1**2
    assert stability_limit(body, "Euler", elongation=0.1) == pytest.approx(2 / math.sqrt(tangent))
    limit = stability_limit(body, "Euler", elongation=0.1, secant=True)
    assert limit == pytest.approx(2 / math.sqrt(secant))
    damped = mcmj.Body([(0, 0), (1, 0)], [(0, 1)], [TINY], [0.0], [1.0], [100.0],
                       fixed=np.array([True, False]))  # fmt: skip
    assert stability_limit(damped, "Euler", speed=2.0) == pytest.approx(2 / (1 + 300 * 4))


# --- prediction against bisection -------------------------------------------------------------


@pytest.mark.parametrize(
    ("d1", "cubic"), [((0.05, 0.1), 0.0), ((3.0, 6.0), 20.0), ((30.0, 60.0), 0.0)]
)
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_predicted_limit_is_measured(integrator, d1, cubic):
    body = network(d1=d1, cubic=cubic)
    predicted = stability_limit(body, integrator)
    if predicted == math.inf:
        assert not any(loses_stability(body, integrator, step) for step in (0.1, 1.0, 10.0))
        return
    measured = bisect(lambda h: not loses_stability(body, integrator, h), predicted, 4e-3)
    assert measured / predicted == pytest.approx(1.0, abs=0.006)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_predicted_limit_in_closed_loop_is_measured(integrator):
    body = network(d1=(3.0, 6.0), n_outputs=2)
    w_out = readout(body, 5.0)
    predicted = stability_limit(body, integrator, w_out=w_out)
    if predicted == math.inf:
        assert not any(loses_stability(body, integrator, step, w_out) for step in (0.1, 1.0))
        return
    assert predicted < stability_limit(body, integrator)
    measured = bisect(lambda h: not loses_stability(body, integrator, h, w_out), predicted, 4e-3)
    assert measured / predicted == pytest.approx(1.0, abs=0.01)


def test_large_bodies_are_as_small_ones(monkeypatch):
    body = network(nodes=130, d1=(3.0, 6.0))
    sparse = [stability_limit(body, name) for name in INTEGRATORS]
    monkeypatch.setattr("mcmj.simulation.stepsize.eigenvalues.DENSE", 1000)
    monkeypatch.setattr("mcmj.simulation.stepsize.eigenvalues.DENSE_MODES", 1000)
    dense = {name: stability_limit(body, name) for name in INTEGRATORS}
    for name, limit in zip(INTEGRATORS, sparse, strict=True):
        if name == "RK4":  # a bound there
            assert 0.5 * dense[name] < limit <= dense[name]
        else:
            assert limit == pytest.approx(dense[name], rel=1e-6)


# --- advice and warning -----------------------------------------------------------------------


def test_warning_names_what_will_do():
    body = network(d1=(30.0, 60.0))
    limit = stability_limit(body, "Euler")
    with pytest.warns(StabilityWarning, match=r"step 50 ms is above .* ms, .*integrator Euler"):
        mcmj.Simulation(body, timestep=0.05, integrator="Euler")
    assert issubclass(StabilityWarning, McmjWarning)
    advice = recommend(body, 0.05, "Euler")
    assert advice.limit == limit
    assert f"substeps={advice.substeps}" in str(advice)
    assert "integrator='discrete'" in str(advice)
    assert 0.05 / advice.substeps < limit < 0.05 / (advice.substeps - 4)
    substeps = {"substeps": advice.substeps, "integrator": "Euler"}
    mcmj.Simulation(body, timestep=0.05, **substeps).rollout(100)  # no warning
    for other in advice.others:
        sim = mcmj.Simulation(body, timestep=0.05, integrator=other)
        sim.set_state(velocities=np.full((body.n_nodes, 2), 1e-3))
        assert np.abs(sim.rollout(400, record=("velocities",)).velocities[-1]).max() < 1e-2


def test_an_ensemble_warns_too():
    with pytest.warns(StabilityWarning):
        mcmj.Ensemble(network(d1=(30.0, 60.0)), copies=2, timestep=0.05)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_no_warning_below_the_limit(integrator):
    body = network(d1=(3.0, 6.0))
    limit = stability_limit(body, integrator)
    mcmj.Simulation(body, timestep=min(0.99 * limit, 1.0), integrator=integrator)
    mcmj.Simulation(mcmj.random_body(0), integrator=integrator)
    if limit < math.inf:
        with pytest.warns(StabilityWarning, match="use substeps=2"):
            mcmj.Simulation(body, timestep=1.01 * limit, integrator=integrator)


def test_callback_springs_are_euler_to_implicit_integrators():
    body = network(d1=(30.0, 60.0))
    euler = stability_limit(body, "Euler")
    assert stability_limit(body, "discrete", springs="cubic") == pytest.approx(euler)
    with pytest.warns(StabilityWarning) as caught:
        mcmj.Simulation(body, timestep=2 * euler, integrator="discrete", springs="cubic")
    assert "discrete'" not in str(caught[0].message)


def test_the_check_is_cheap():
    body = mcmj.random_body(0, 100)

    def seconds(function):
        start = time.perf_counter()
        function()
        return time.perf_counter() - start

    check = min(seconds(lambda: warn_if_unstable(body, Options()))
                for _ in range(5))  # fmt: skip
    whole = min(seconds(lambda: mcmj.Simulation(body)) for _ in range(3))
    assert check < 0.05 * whole


def test_bad_arguments_are_named():
    with pytest.raises(UnknownNameError, match="discrete"):
        stability_limit(network(), "euler")
    with pytest.raises(InvalidArgumentError, match="speed"):
        stability_limit(network(), "Euler", speed=-1.0)
    with pytest.raises(InvalidArgumentError, match="elongation"):
        stability_limit(network(), "Euler", elongation=[1.0, 2.0])
    with pytest.raises(InvalidArgumentError, match="timestep"):
        recommend(network(), 0.0)
