"""A simulation that blows up says so, in words and to nobody else."""

import mujoco
import numpy as np
import pytest
from rollouts import ALL, same_bits

import mcmj
from mcmj import Ensemble, Simulation
from mcmj.simulation.simulation import CHUNK
from mcmj.utils.errors import DivergenceError, McmjError


@pytest.fixture
def explosive():
    """Stiff dampers under an explicit integrator: blows up as soon as something moves."""
    return mcmj.random_body(1, nodes=6, d3=(1e5, 1e5))


@pytest.mark.filterwarnings("ignore")  # a warning beforehand is welcome
@pytest.mark.parametrize("with_hook", [False, True])
def test_divergence_says_when_where_and_what_to_try(
    explosive, tmp_path, monkeypatch, capfd, with_hook
):
    monkeypatch.chdir(tmp_path)
    simulation = Simulation(explosive, timestep=5e-3)
    options = {"hook": lambda time, lengths: np.zeros(6)} if with_hook else {}
    with pytest.raises(DivergenceError) as caught:
        simulation.rollout(2000, forces=np.full(6, 1000.0), **options)
    error = caught.value
    assert isinstance(error, ArithmeticError)
    assert isinstance(error, McmjError)
    for text in (
        f"t = {error.time:.6g} s",
        "node ",
        "leapfrog",
        "step 5 ms",
        "substeps=2",
        "discrete",
    ):
        assert text in str(error)
    assert 0 < error.time < 1.0
    assert error.time == pytest.approx(5e-3 * error.steps_done, abs=5.1e-3)
    assert capfd.readouterr() == ("", "")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.filterwarnings("ignore")
def test_divergence_after_many_steps_counts_them_all(explosive):
    """steps_done is of the rollout, not of the last chunk."""
    calm = CHUNK + 500
    forces = np.zeros((calm + 200, 6))
    forces[calm:] = 1000.0
    with pytest.raises(DivergenceError) as caught:
        Simulation(explosive, timestep=5e-3).rollout(forces=forces)
    assert caught.value.steps_done == pytest.approx(calm, abs=50)
    assert caught.value.time == pytest.approx(5e-3 * calm, abs=0.25)


@pytest.mark.filterwarnings("ignore")
def test_the_remedies_work(explosive):
    forces = np.full(6, 20.0)
    with pytest.raises(DivergenceError):
        Simulation(explosive, timestep=5e-3).rollout(2000, forces=forces)
    good = Simulation(explosive, timestep=5e-3, integrator="discrete").rollout(400, forces=forces)
    assert np.isfinite(good.lengths).all()


@pytest.mark.filterwarnings("ignore")
def test_a_simulation_can_be_reset_after_divergence(explosive):
    simulation = Simulation(explosive, timestep=5e-3)
    with pytest.raises(DivergenceError):
        simulation.rollout(2000, forces=np.full(6, 1000.0))
    simulation.reset()
    assert simulation.time == 0.0
    run = simulation.rollout(100, record=ALL)
    assert same_bits(run, Simulation(explosive, timestep=5e-3).rollout(100, record=ALL))


@pytest.mark.filterwarnings("ignore")
def test_divergence_in_an_ensemble_names_the_copy(explosive):
    forces = np.zeros((3, 300, 6))
    forces[1] = 1000.0
    with pytest.raises(DivergenceError, match=r"^copy 1: ") as caught:
        Ensemble(explosive, copies=3, threads=2, timestep=5e-3).rollout(forces=forces)
    assert caught.value.time < 1.0


def test_our_silence_ends_with_the_rollout(body):
    heard = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(heard.append)
    try:
        Simulation(body).rollout(3)
        model = mujoco.MjModel.from_xml_string(mcmj.to_mjcf(body))
        data = mujoco.MjData(model)
        data.qpos[0] = np.nan
        mujoco.mj_step(model, data)
    finally:
        mujoco.set_mju_user_warning(before)
    assert "QPOS" in heard[0]
