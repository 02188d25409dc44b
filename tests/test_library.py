"""The bodies that come with mcmj: what they are, and that each does what its name says."""

from dataclasses import fields

import numpy as np
import pytest

import mcmj
from mcmj.bodyfile import load_model, provenance_of_model, readouts_of_model
from mcmj.errors import UnknownNameError
from mcmj.library import body_names, body_path
from mcmj.metrics import orbit_error
from mcmj.teaching import synchronise

SPECIALISED = {"van_der_pol": (10, 22), "quadratic": (20, 51), "lissajous": (20, 48)}


@pytest.mark.parametrize(("name", "size"), SPECIALISED.items())
def test_specialised_bodies_have_the_papers_sizes_and_run_their_cycle(name, size):
    """Run free on the twin for 80 s from the cycle, and from total rest, to the last 20 s."""
    body, w_out = mcmj.from_mjcf(body_path(name))
    assert (body.n_nodes, body.n_springs) == size
    simulation = mcmj.Simulation(body, engine="twin")
    goal = mcmj.target(name)
    synchronise(simulation, goal, 20.0)
    simulation.set_readout(w_out)
    for begin in (lambda: None, simulation.reset):
        begin()
        simulation.rollout(60_000, record=())
        outputs = simulation.rollout(20_000, record=("outputs",)).outputs
        assert orbit_error(outputs, goal) < 0.01


@pytest.mark.parametrize("name", body_names())
def test_every_body_says_where_it_comes_from_and_can_be_drawn_again(name):
    model = load_model(body_path(name))
    body, _ = mcmj.from_mjcf(body_path(name))
    provenance = provenance_of_model(model)
    account = provenance.get("body", provenance)
    settings = {
        key: tuple(v) if isinstance(v, list) else v for key, v in account["settings"].items()
    }
    again = mcmj.random_body(account["seed"], **settings)
    for field in fields(body):  # exp and log differ in the last digit from machine to machine
        drawn, kept = getattr(again, field.name), getattr(body, field.name)
        np.testing.assert_allclose(drawn, kept, rtol=1e-14, err_msg=field.name)
    for readout in readouts_of_model(model).values():
        assert np.isfinite(readout).all()


def test_an_unknown_body_lists_those_there_are():
    with pytest.raises(
        UnknownNameError, match="general, input_driven, lissajous, quadratic, van_der_pol"
    ):
        body_path("nobody")
