"""What the viewer steps is the closed loop; and the viewer itself, on a virtual screen."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from models import CHAIN, CHAIN_PARTS

import mcmj
from mcmj.experiments.view.run import Config, run
from mcmj.metrics import orbits
from mcmj.pictures.window.body_viewer import shown_model
from mcmj.pictures.window.viewer import NoDisplayError
from mcmj.simulation.interactive import LiveLoop
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError

SCRIPT = Path(__file__).parents[2] / "scripts" / "view.py"


@pytest.fixture
def loop(body, w_out, w_bias):
    return LiveLoop(mcmj.Simulation(body), {"plain": w_out, "biased": w_bias})


def positions(loop):
    """Of the nodes now (N, 2)."""
    body = loop.reservoir.body
    found = body.positions.copy()
    found[body.free] += loop.data.qpos.reshape(-1, 2)
    return found


def pushes(loop, forces):
    """Forces (N, 2) on the nodes as (n_bodies, 6)."""
    found = np.zeros((loop.model.nbody, 6))
    for node in loop.reservoir.body.free:
        found[loop.model.body(f"n{node}").id, :2] = forces[node]
    return found


def test_it_is_the_closed_loop(loop, body, w_out, w_bias):
    simulation = mcmj.Simulation(body, w_out=w_out)
    loop.advance(700)
    assert np.abs(positions(loop) - simulation.rollout(700).final_state.positions).max() < 1e-12
    loop.switch_next()
    assert loop.readout == "biased"
    simulation.set_readout(w_bias)
    loop.advance(500)
    assert np.abs(positions(loop) - simulation.rollout(500).final_state.positions).max() < 1e-12
    outputs = simulation.rollout(1).outputs[0]
    assert np.abs(loop.outputs - outputs).max() < 1e-12
    assert loop.time == pytest.approx(1.2)
    loop.switch_next()
    assert loop.readout == "plain"


def test_freezing_is_that_of_a_schedule(loop, body, w_out):
    schedule = mcmj.Schedule([mcmj.Phase(0.4, freeze=(1,)), mcmj.Phase(0.3)])
    simulation = mcmj.Simulation(body, w_out=w_out)
    simulation.rollout(300)
    wanted = mcmj.run_schedule(simulation, schedule, seed=0)
    loop.advance(300)
    loop.freeze(1)
    loop.advance(399)
    assert np.abs(loop.outputs - wanted.feedback[399]).max() < 1e-12
    loop.advance(1)
    loop.freeze(1)
    loop.advance(300)
    assert np.abs(positions(loop) - simulation.state.positions).max() < 1e-12


def test_forces_and_kicks_move_the_nodes(body, w_out):
    """Under Euler: a simulation's forces act half a step later under the leapfrog."""
    loop = LiveLoop(mcmj.Simulation(body, integrator="Euler"), {"plain": w_out})
    horizontal = np.zeros((body.n_nodes, 2))
    horizontal[:, 0] = np.arange(body.n_nodes)
    loop.advance(200, pushes(loop, horizontal))
    simulation = mcmj.Simulation(body, w_out=w_out, integrator="Euler")
    run = simulation.rollout(200, forces=horizontal[:, 0])
    assert np.abs(positions(loop) - run.final_state.positions).max() < 1e-12
    loop.reset()
    loop.advance(
        1, pushes(loop, horizontal[:, ::-1])
    )  # upwards: p = h^2 F / m after one step, beside the rest
    free, moved = body.free, positions(loop)
    loop.reset()
    loop.advance(1)
    lift = 1e-6 * horizontal[free, 0] / body.masses[free]
    assert (moved - positions(loop))[free, 1] == pytest.approx(lift, abs=1e-12)
    loop.reset()
    loop.kick(2.0, np.random.default_rng(0))
    loop.advance(1)
    assert 1e-3 < np.abs(positions(loop) - body.positions).max() < 1e-2
    assert loop.alive


def test_a_kick_under_leapfrog_is_one_of_a_simulation(body, w_out):
    """Velocities are those at half steps: what is added must not look like a change in time."""
    simulation = mcmj.Simulation(body, w_out=w_out, integrator="leapfrog")
    loop = LiveLoop(simulation, {"plain": w_out})
    loop.advance(200)
    loop.kick(0.5, np.random.default_rng(0))
    loop.advance(100)
    simulation.rollout(200)
    kick = np.zeros(body.positions.shape)
    draw = np.random.default_rng(0).standard_normal(loop.data.qvel.shape)
    kick[body.free] = 0.5 * draw.reshape(-1, 2)
    simulation.set_state(velocities=simulation.state.velocities + kick)
    simulation.rollout(100)
    assert np.abs(positions(loop) - simulation.state.positions).max() < 1e-12


def test_any_model_is_its_rollout(tmp_path):
    w_out = np.random.default_rng(0).normal(size=(5, 2)) / 50
    reservoir = mcmj.Reservoir(CHAIN, **CHAIN_PARTS, w_out=w_out)
    reservoir.set_state(qvel=[1.0, -2.0])
    loop = LiveLoop(reservoir, {"taught": w_out})
    loop.advance(500)
    run = reservoir.rollout(500)
    assert np.array_equal(loop.data.qpos, reservoir.qpos)
    held = loop.outputs[0]
    loop.freeze(0)
    loop.advance(300)
    offset = np.tile([held, 0.0], (300, 1))
    reservoir.rollout(offset=offset, gate=(0.0, 1.0))
    assert np.array_equal(loop.data.qpos, reservoir.qpos)
    assert loop.outputs[0] == held
    loop.reset()
    loop.advance(1)
    assert np.abs(loop.data.sensordata[loop._engine.channels.signals] - run.signals[0]).max() == 0
    with pytest.raises(InvalidArgumentError, match="engine: expected 'mujoco'"):
        LiveLoop(mcmj.Simulation(mcmj.random_body(0), engine="twin"), {"w": w_out})


def test_every_free_node_can_be_picked_by_the_mouse(body):
    model = shown_model(body)
    owners = {int(model.geom_bodyid[g]) for g in range(model.ngeom)}
    assert owners == {model.body(f"n{i}").id for i in body.free}
    assert np.array_equal(model.body_mass[sorted(owners)], body.masses[body.free])


def test_what_does_not_fit_is_said(loop, body, monkeypatch):
    with pytest.raises(InvalidArgumentError, match="readouts: expected at least one"):
        LiveLoop(mcmj.Simulation(body), {})
    with pytest.raises(UnknownNameError, match="valid choices: biased, plain"):
        loop.switch("trot")
    with pytest.raises(InvalidArgumentError, match="channel: expected 0 to 1"):
        loop.freeze(2)
    with pytest.raises(InvalidArgumentError, match="press: expected key@second"):
        Config(press=("kick",))
    monkeypatch.setenv("DISPLAY", ":99999")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(NoDisplayError, match="cannot open a window"):
        run(Config(body="van_der_pol"))


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("Xvfb"), reason="no Xvfb: apt-get install xvfb")
def test_the_viewer_shows_a_kick_and_the_recovery(tmp_path):
    reader, writer = os.pipe()
    screen = subprocess.Popen(
        ["Xvfb", "-displayfd", str(writer), "-screen", "0", "800x600x24"],
        pass_fds=[writer], stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        os.close(writer)
        with os.fdopen(reader) as ready:
            display = f":{ready.readline().strip()}"
        words = [sys.executable, SCRIPT, "--body", "van_der_pol", "--seconds", "16", "--press"]
        words += ["8@1", "6@14", "9@14.2", "--kick-speed", "0.2", "--out", tmp_path, "--quiet"]
        environment = os.environ | {"DISPLAY": display}
        done = subprocess.run(
            list(map(str, words)), env=environment, capture_output=True, text=True, timeout=100
        )
    finally:
        screen.terminate()
        screen.wait()
    assert done.returncode == 0, done.stderr
    seen = json.loads((tmp_path / "metrics.json").read_text())["metrics"]
    assert seen["frames"] > 20
    with np.load(tmp_path / "trajectory.npz") as arrays:
        times, outputs = arrays["times"], arrays["outputs"]
    away = orbits.orbit_distances(outputs, mcmj.target("van_der_pol"))
    assert away[times < 1.0].max() < 0.02
    assert away[(times > 1.0) & (times < 2.0)].max() > 0.1
    assert away[(times > 12.0) & (times < 14.0)].max() < 0.05
    assert np.ptp(outputs[times > 14.5, 0]) == 0.0  # frozen
