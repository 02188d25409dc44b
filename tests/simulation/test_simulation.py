"""What a Simulation records, and the arguments that it refuses."""

import numpy as np
import pytest
from rollouts import ALL

from mcmj import Simulation
from mcmj.core.integrators import INTEGRATORS
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError


@pytest.mark.parametrize("record", [(), *[(n,) for n in ALL], ("outputs", "positions"), ALL])
def test_only_what_is_asked_for_is_recorded(body, w_out, record):
    run = Simulation(body, w_out=w_out).rollout(10, record=record)
    everything = Simulation(body, w_out=w_out).rollout(10, record=ALL)
    for name in ALL:
        if name in record:
            assert run.get(name).tobytes() == everything.get(name).tobytes()
        else:
            assert getattr(run, name) is None
            with pytest.raises(UnknownNameError):
                run.get(name)
    assert np.array_equal(run.times, 1e-3 * np.arange(10))


def test_unknown_record_lists_the_names(body):
    with pytest.raises(UnknownNameError) as caught:
        Simulation(body).rollout(3, record=("forces",))
    assert caught.value.choices == sorted(ALL)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"inputs": np.zeros((5, 3))}, "inputs: expected shape (any, 2), got shape (5, 3)"),
        ({"inputs": np.zeros(5)}, "inputs: expected shape (any, 2), got shape (5,)"),
        ({"offset": np.zeros((5, 1))}, "offset: expected shape (any, 2), got shape (5, 1)"),
        ({"offset": [[np.nan, 0]]}, "offset: expected finite numbers, got nan at index (0, 0)"),
        ({"steps": 5, "forces": np.zeros(3)}, "forces: expected shape (8), got shape (3,)"),
        ({"forces": np.zeros((5, 3))}, "forces: expected shape (any, 8), got shape (5, 3)"),
        ({"steps": 5, "gate": [1, 1, 1]}, "gate: expected shape (2), got shape (3,)"),
        ({"steps": 4, "inputs": np.zeros((5, 2))}, "inputs: expected 4 rows, one a step, got 5"),
        (
            {"inputs": np.zeros((5, 2)), "offset": np.zeros((6, 2))},
            "offset: expected 5 rows, one a step, got 6",
        ),
        ({"steps": 5, "forces": np.zeros((2, 8))}, "forces: expected 5 rows, one a step, got 2"),
        ({"steps": -1}, "steps: expected an integer >= 1, got -1"),
        ({"steps": 2.5}, "steps: expected an integer >= 1, got 2.5"),
        (
            {},
            "steps: expected a number of steps, or inputs, offset or forces over time, got None",
        ),
    ],
)
def test_wrong_drives_are_named(body, options, text):
    with pytest.raises(InvalidArgumentError) as caught:
        Simulation(body).rollout(**options)
    assert str(caught.value) == text


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("timestep", 0.0),
        ("timestep", -1e-3),
        ("timestep", np.inf),
        ("feedback_delay", -1),
        ("feedback_delay", 0.5),
        ("substeps", 0),
        ("substeps", 1.0),
        ("w_out", np.zeros((3, 2))),
    ],
)
def test_wrong_settings_are_named(body, name, value):
    with pytest.raises(InvalidArgumentError) as caught:
        Simulation(body, **{name: value})
    assert caught.value.name == name


def test_wrong_state_and_snapshot_are_named(body):
    simulation = Simulation(body)
    with pytest.raises(InvalidArgumentError, match=r"^velocities: expected shape \(8, 2\)"):
        simulation.set_state(velocities=np.zeros((7, 2)))
    with pytest.raises(InvalidArgumentError, match=r"^snapshot: "):
        simulation.restore(np.zeros((1, 3)))
    with pytest.raises(InvalidArgumentError, match=r"^chunk: "):
        simulation.stream(5, chunk=0)


def test_unknown_integrator_lists_the_names(body):
    with pytest.raises(UnknownNameError) as caught:
        Simulation(body, integrator="euler")
    assert caught.value.choices == sorted(INTEGRATORS)
