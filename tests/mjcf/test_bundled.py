"""The bodies that come with mcmj: what they are, and that each does what its name says."""

import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

import mcmj
from mcmj.experiments.limit_cycle import config as limit_cycle_config
from mcmj.experiments.limit_cycle import run as limit_cycle
from mcmj.experiments.perturb import run as perturb
from mcmj.experiments.render import run as render
from mcmj.experiments.view import run as view
from mcmj.learning.teaching import synchronise
from mcmj.metrics.orbits import orbit_error
from mcmj.mjcf.bundled import body_names, body_path, open_body
from mcmj.mjcf.kept import provenance_of_model
from mcmj.mjcf.read import load_model, readouts_of_model
from mcmj.search.body_space import BodySpace
from mcmj.utils.errors import OtherPhysicsWarning, UnknownNameError

SCRIPTS = Path(__file__).parents[2] / "scripts"
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
    if "x" in provenance:  # a designed body: that far from the random one
        again = BodySpace(again, provenance["varied"]).body(provenance["x"])
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


def written(path, name="quadratic", **how):
    """The body of a name in a file of its own, with its readout, written in another way."""
    body, w_out = mcmj.from_mjcf(body_path(name))
    text = mcmj.to_mjcf(body, w_out=w_out, readouts={name: w_out}, **how)
    path.write_text(text)
    return str(path)


OTHERS = {
    "timestep 0.0005": {"timestep": 5e-4},
    "springs tansig": {"springs": "tansig"},
    "feedback_delay 2": {"feedback_delay": 2e-3},
}


@pytest.mark.parametrize("said", OTHERS)
def test_what_a_run_does_not_take_from_a_file_is_a_warning(said, tmp_path):
    path = written(tmp_path / "body.xml", **OTHERS[said])
    config = limit_cycle_config.Config(task="quadratic", body=path)
    with pytest.warns(OtherPhysicsWarning, match=f"written for {said}; this run takes"):
        limit_cycle_config.get_body(config)
    with pytest.warns(OtherPhysicsWarning, match=said):
        view._simulation_and_readouts(view.Config(body=path))


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "discrete"])
def test_commands_keep_the_integrator_of_the_file(integrator, tmp_path):
    path = written(tmp_path / "body.xml", integrator=integrator)
    config = limit_cycle_config.Config(task="quadratic", body=path, free_run=40.0)
    *_, stepping = limit_cycle_config.get_body(config)
    assert stepping["integrator"] == integrator
    shown, _ = view._simulation_and_readouts(view.Config(body=path))
    assert shown.options.integrator == integrator
    with pytest.warns(OtherPhysicsWarning, match=f"for integrator {integrator}; this run takes i"):
        limit_cycle_config.get_body(replace(config, integrator="leapfrog"))


def test_the_twin_takes_the_integrators_that_it_has(tmp_path):
    stored = open_body(written(tmp_path / "body.xml", integrator="Euler"))
    assert stored.take(engine="twin") == {"integrator": "Euler", "engine": "twin"}
    stored = open_body(written(tmp_path / "body.xml", integrator="discrete"))
    with pytest.warns(OtherPhysicsWarning, match="this run takes integrator leapfrog"):
        assert stored.take(engine="twin") == {"engine": "twin"}


def test_a_film_is_run_as_the_file_says(tmp_path):
    how = {"integrator": "RK4", "timestep": 5e-4, "springs": "tansig"}
    path = written(tmp_path / "body.xml", **how)
    film = render.run(render.Config(body=path, from_rest=True, duration=0.2))
    simulation = mcmj.Simulation(mcmj.from_mjcf(path)[0], w_out=mcmj.from_mjcf(path)[1], **how)
    alone = simulation.rollout(400, record=("positions",)).positions
    assert np.array_equal(film.positions, alone)
    with pytest.warns(OtherPhysicsWarning, match=r"timestep 0\.0005; this run takes timestep 0"):
        _body, settings = perturb.get_body(perturb.Config(body=path), 0)
    assert settings == how | {"timestep": 1e-3, "engine": "mujoco"}


def test_a_command_shows_a_warning_in_one_line(tmp_path):
    law = mcmj.SpringLaw("mine", lambda x1, x2, k1, k3, d1, d3: k1 * x1 + d1 * x2)
    path = written(tmp_path / "body.xml", springs=law)
    command = [
        *(sys.executable, SCRIPTS / "render.py", "--body", path, "--out", tmp_path / "film"),
        *("--from-rest", "--duration", "0.1", "--formats", "png", "--stills", "1"),
        *("--renderer", "matplotlib"),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stderr.strip().splitlines() == [
        "render: warning: the body file was written for springs mine; this run takes springs native"
    ]


def test_a_body_file_is_read_once_a_run(tmp_path):
    path = tmp_path / "body.xml"
    config = limit_cycle.Config(
        task="quadratic", body=written(path), free_run=25.0, measure_cost=False
    )
    kept = tmp_path / "run"
    kept.mkdir()
    result = limit_cycle.run(config, folder=kept, on_steps=lambda _: path.unlink(missing_ok=True))
    assert not path.exists()
    assert result.metrics["quadratic"]["orbit_error"] < 0.01
    result.remove_checkpoints()
    assert not list(kept.iterdir())
