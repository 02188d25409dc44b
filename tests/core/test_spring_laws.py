"""Springs as compiled forces: equal to MuJoCo's own where both exist, to the twin elsewhere."""

from math import atan

import numpy as np
import pytest
import twins

import mcmj
from mcmj import Simulation, SpringLaw
from mcmj.core.callbacks.spring_laws import SPRING_LAWS, spring_law
from mcmj.core.integrators import INTEGRATORS
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError

RECORD = ("lengths", "outputs", "positions", "velocities")


def largest_difference(one, other, names=RECORD):
    return max(np.abs(getattr(one, name) - getattr(other, name)).max() for name in names)


def driven(body, steps):
    return {"forces": 20 * np.sin(0.01 * np.arange(steps)[:, None] + np.arange(body.n_nodes))}


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_cubic_hook_equals_native(body, w_out, integrator):
    """Over 1000 steps; the implicit integrators differ, as they know only native derivatives."""
    native, hook = (
        Simulation(body, w_out=w_out, integrator=integrator, springs=springs).rollout(
            **driven(body, 1000), record=RECORD
        )
        for springs in ("native", "cubic")
    )
    assert np.ptp(native.lengths, axis=0).max() > 0.3
    assert largest_difference(native, hook) < 2e-13  # the goal is 1e-12


@pytest.mark.parametrize("integrator", ["implicit", "implicitfast", "discrete"])
def test_implicit_integrators_agree_with_the_hook_to_their_own_error(body, integrator):
    """Halving the step halves the distance: both are first-order ways to the same motion."""
    distances = []
    for halvings in (2, 3):
        ends = [
            Simulation(body, integrator=integrator, springs=springs, substeps=2**halvings).rollout(
                600, forces=np.linspace(-20, 20, body.n_nodes)
            )
            for springs in ("native", "cubic")
        ]
        distances.append(largest_difference(*ends, names=("lengths",)))
    assert 1e-6 < distances[1] < distances[0] < 5e-3
    assert distances[0] / distances[1] == pytest.approx(2.0, rel=0.2)


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_tansig_follows_the_twin(body, w_out, integrator):
    steps = 400
    rollout = Simulation(
        body, w_out=w_out, integrator=integrator, springs="tansig", timestep=5e-4
    ).rollout(**driven(body, steps), record=RECORD)
    twin = twins.run(
        body,
        steps,
        integrator=integrator,
        w_out=w_out,
        pull=twins.tansig,
        timestep=5e-4,
        **driven(body, steps),
    )
    assert largest_difference(rollout, twin) < 1e-11


def arctangent(x1, x2, k1, k3, d1, d3):
    return k1 * atan(k3 * x1) + d1 * x2 / (1.0 + d3 * x2 * x2)


def test_a_law_of_one_s_own_follows_the_twin(body, w_out):
    def pull(x1, x2, body):
        return body.k1 * np.arctan(body.k3 * x1) + body.d1 * x2 / (1 + body.d3 * x2**2)

    law = SpringLaw("arctangent", arctangent)
    simulation = Simulation(body, w_out=w_out, integrator="Euler", springs=law)
    rollout = simulation.rollout(**driven(body, 300), record=RECORD)
    twin = twins.run(body, 300, w_out=w_out, pull=pull, **driven(body, 300))
    assert largest_difference(rollout, twin) < 1e-11


def test_hook_runs_on_several_threads(body, w_out):
    options = {"w_out": w_out, "springs": "tansig", "timestep": 2.5e-4}
    alone = Simulation(body, **options).rollout(100)
    many = mcmj.Ensemble(body, copies=5, threads=2, **options).rollout(100)
    assert all(lengths.tobytes() == alone.lengths.tobytes() for lengths in many.lengths)


@pytest.mark.parametrize("name", SPRING_LAWS)
def test_compiled_law_is_its_python_function(name):
    law = SPRING_LAWS[name]
    for values in np.random.default_rng(0).normal(size=(50, 6)):
        assert law._compiled.ctypes(*values) == pytest.approx(law.pull(*values), rel=1e-13)


@pytest.mark.parametrize("springs", ["linear", "", "Cubic"])
def test_unknown_law_lists_the_choices(body, springs):
    with pytest.raises(UnknownNameError) as caught:
        Simulation(body, springs=springs)
    assert caught.value.choices == ["cubic", "native", "tansig"]
    assert "valid choices: cubic, native, tansig" in str(caught.value)


def test_native_is_no_law():
    assert spring_law("native") is None
    assert spring_law("tansig") is SPRING_LAWS["tansig"]


@pytest.mark.parametrize("name", ["", "native", "two words", "a/b"])
def test_bad_law_names(name):
    with pytest.raises(InvalidArgumentError, match=r"^name: "):
        SpringLaw(name, arctangent)


def test_a_law_must_be_a_function():
    with pytest.raises(InvalidArgumentError, match=r"^pull: "):
        SpringLaw("mine", 3.0)


def test_every_integrator_takes_a_hook(body):
    for integrator in INTEGRATORS:
        end = Simulation(body, integrator=integrator, springs="cubic").rollout(
            500, forces=np.linspace(-5, 5, body.n_nodes)
        )
        reference = twins.run(body, 500, integrator="RK4", forces=np.linspace(-5, 5, body.n_nodes))
        assert np.abs(end.lengths - reference.lengths).max() < 2e-3, integrator
