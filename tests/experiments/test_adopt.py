"""Adopted models: their loop is a plain loop of mj_step; the tensegrity is one."""

from dataclasses import replace
from itertools import combinations

import mujoco
import numpy as np
import pytest

from mcmj.experiments.adopt.config import Config
from mcmj.experiments.adopt.models import ADOPTIONS, build
from mcmj.metrics.orbits import rms_radius
from mcmj.mjcf.bundled import body_names, model_names, model_path
from mcmj.simulation.reservoir import Reservoir
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError

OF_SUITE = {"swimmer", "fish", "cheetah", "quadruped"}
T = 3000


def built(name, integrator=None):
    if name in OF_SUITE:
        pytest.importorskip("dm_control")
    config = Config(model=name)
    adoption, target = config.adoption(name), config.target(name)
    if name == "soft_arm" and integrator == "RK4":
        adoption = replace(adoption, timestep=5e-5)  # its dampers are stiff
    if integrator is not None:
        load = adoption.load
        adoption = replace(adoption, load=lambda: with_integrator(load(), integrator))
    return build(adoption, target, rms_radius(target.orbit(512))), target


def with_integrator(model, integrator):
    spec = model if isinstance(model, mujoco.MjSpec) else mujoco.MjSpec.from_file(str(model))
    spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    return spec


def signals_of(model, data, names):
    """By hand, from the joints' and tendons' own arrays; other sensors as MuJoCo has them."""
    values = []
    for name in names:
        kind, _, rest = name.partition(":")
        if kind == "jointpos":
            values.append(data.qpos[model.jnt_qposadr[model.joint(rest).id]])
        elif kind == "jointvel":
            values.append(data.qvel[model.jnt_dofadr[model.joint(rest).id]])
        elif kind == "tendonpos":
            values.append(data.ten_length[model.tendon(rest).id])
        elif kind == "tendonvel":
            values.append(data.ten_velocity[model.tendon(rest).id])
        else:
            sensor, _, place = name.partition("[")
            values.append(data.sensor(sensor).data[int(place.rstrip("]"))])
    return np.array(values)


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["Euler", "implicit", "implicitfast", "discrete", "RK4"])
@pytest.mark.parametrize("name", list(ADOPTIONS))
def test_signals_and_outputs_agree_with_a_plain_loop(name, integrator):
    made, target = built(name, integrator)
    reservoir = made.reservoir
    rng = np.random.default_rng(1)
    w_out = 1e-2 * rng.standard_normal((reservoir.n_signals + 1, 2))
    offset = target.sample(np.arange(T) * reservoir.timestep)
    reservoir.set_readout(w_out)
    run = reservoir.rollout(offset=offset, gate=0.5, record=("signals", "outputs"))

    spec = with_integrator(ADOPTIONS[name].load(), integrator)
    spec.option.timestep = reservoir.timestep
    model = spec.compile()
    data = mujoco.MjData(model)
    signals, outputs = [], []
    for k in range(T):
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_sensorPos(model, data)
        mujoco.mj_sensorVel(model, data)
        s = signals_of(model, data, reservoir.signal_names)
        y = s @ w_out[:-1] + w_out[-1]
        data.ctrl[:] = made.gains @ (0.5 * y + offset[k])
        signals.append(s)
        outputs.append(y)
        mujoco.mj_step(model, data)
    # rounding, which the tensegrity's contacts magnify: bars roll (Euler 1e-12, RK4 9e-12)
    tolerance = 5e-11 if name == "tensegrity" else 1e-12
    for found, wanted in ((run.signals, signals), (run.outputs, outputs)):
        assert np.abs(found - wanted).max() < tolerance * np.abs(wanted).max()


def tensegrity(*, ground=True):
    spec = mujoco.MjSpec.from_file(str(model_path("tensegrity")))
    if not ground:
        spec.option.gravity = [0, 0, 0]
        spec.delete(spec.geom("ground"))
    return spec.compile()


def test_the_models_are_no_planar_bodies():
    assert model_names() == ["soft_arm", "tensegrity"]
    assert not set(model_names()) & set(body_names())
    with pytest.raises(UnknownNameError, match="unknown model 'none'; valid choices: soft_arm"):
        model_path("none")


def test_the_tensegrity_is_in_equilibrium_without_gravity():
    model = tensegrity(ground=False)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    # every node: the pull of its cables is along its bar
    pull = {model.site(i).name: np.zeros(3) for i in range(model.nsite)}
    for t in range(model.ntendon):
        sites = model.wrap_objid[model.tendon_adr[t] : model.tendon_adr[t] + 2]
        a, b = (data.site_xpos[i] for i in sites)
        length = np.linalg.norm(b - a)
        assert length == pytest.approx(np.sqrt(6) / 8, abs=1e-9)
        tension = model.tendon_stiffness[t] * (length - model.tendon_lengthspring[t, 1])
        assert tension > 4.5  # N: no cable is slack
        for site, sign in zip(sites, (1.0, -1.0), strict=True):
            pull[model.site(site).name] += sign * tension * (b - a) / length
    for bar in range(6):
        along = data.site(f"{bar}b").xpos - data.site(f"{bar}a").xpos
        for end in "ab":
            assert np.linalg.norm(np.cross(pull[f"{bar}{end}"], along)) < 1e-8
    assert np.abs(data.qacc).max() < 1e-5  # 6e-7 here: the file has ten digits
    assert model.ntendon == model.nu == 24


def test_the_energy_of_the_tensegrity_decays():
    model = tensegrity(ground=False)
    model.opt.integrator, model.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, 5e-4
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data = mujoco.MjData(model)
    mujoco.mj_energyPos(model, data)
    data.qvel[:] = np.random.default_rng(0).normal(0.0, 0.3, model.nv)
    energies = []
    for _ in range(40):
        mujoco.mj_forward(model, data)
        energies.append(data.energy.sum())
        mujoco.mj_step(model, data, 100)
    assert (np.diff(energies) < 1e-9).all()
    assert energies[-1] < energies[0]


def test_at_work_no_bar_touches_another_and_the_tensegrity_stays_up():
    made, target = built("tensegrity")
    reservoir = made.reservoir
    offset = target.sample(np.arange(2000) * reservoir.timestep)
    qpos = reservoir.rollout(offset=offset, record=("qpos",)).get("qpos")
    model, data = reservoir.model, mujoco.MjData(reservoir.model)
    fromto = np.zeros(6)
    for row in qpos[::50]:
        data.qpos[:] = row
        mujoco.mj_fwdPosition(model, data)
        for one, other in combinations(range(6), 2):
            geoms = (model.geom(f"bar{bar}").id for bar in (one, other))
            assert mujoco.mj_geomDistance(model, data, *geoms, 1.0, fromto) > 0.05  # m
        assert data.site_xpos[:, 2].max() > 0.3


@pytest.mark.parametrize(
    ("options", "error", "text"),
    [
        (
            {"model": "whale"},
            UnknownNameError,
            "unknown model 'whale'; valid choices: .*swimmer, tens",
        ),
        ({"model": "own.xml"}, InvalidArgumentError, "sensors: expected some for own.xml"),
        ({"task": "waltz"}, UnknownNameError, "unknown task 'waltz'"),
        ({"pace": 0.0}, InvalidArgumentError, "pace"),
        ({"window": 100.0}, InvalidArgumentError, "window"),
    ],
)
def test_what_cannot_be_adopted_is_named(options, error, text):
    with pytest.raises(error, match=text):
        Config(**options)


def test_a_model_file_keeps_what_it_learned(tmp_path):
    made, _ = built("soft_arm")
    made.reservoir.set_readout(np.full((made.reservoir.n_signals, 2), 0.1))
    (tmp_path / "arm.xml").write_text(made.reservoir.to_mjcf())
    again = Reservoir.open(tmp_path / "arm.xml")
    one, other = (r.rollout(300).outputs for r in (made.reservoir, again))
    assert np.abs(one - other).max() < 1e-4 * np.abs(one).max()
