"""Capacities, ranks and filters of any reservoir, against a body's, and of a linear one."""

import json

import mujoco
import numpy as np
import pytest

import mcmj
from mcmj.analysis.capacities import Probe, capacities_of, driven_channel
from mcmj.core.random_body import draw_body
from mcmj.experiments.capacity.config import Config, probed_body
from mcmj.experiments.command_line import main
from mcmj.experiments.filters.switching import SwitchConfig, learn_switch
from mcmj.learning.filters import learn_filter
from mcmj.simulation.held_symbols import held_states
from mcmj.targets.filter_tasks import delayed_recall
from mcmj.utils.errors import BodyFileError, InvalidArgumentError, UnknownNameError

QUICK = Probe(symbols=400, washout=20, max_delays=(15, 5), streams=20, stream_symbols=12, shared=4)
SLIDERS = """<mujoco><option timestep="2e-3" gravity="0 0 0"/><default><geom size=".1" mass="1"
contype="0" conaffinity="0"/></default><worldbody>
<body><joint name="p" type="slide" axis="1 0 0" stiffness="20" damping="4"/><geom/></body>
<body><joint name="q" type="slide" axis="1 0 0" stiffness="60" damping="6"/><geom/></body>
</worldbody><tendon><fixed name="t" stiffness="20" springlength="0"><joint joint="p" coef="1"/>
<joint joint="q" coef="-1"/></fixed></tendon><actuator><motor name="m" joint="p"/></actuator>
</mujoco>"""


def sliders(**changes):
    given = {"sensors": ["jointpos:*", "jointvel:*"], "channels": ["m"], **changes}
    return mcmj.Reservoir(SLIDERS, **given)


@pytest.fixture(scope="module")
def pair():
    """A body as a simulation, and its model as a reservoir of its own sensors and actuators."""
    body = draw_body(1, probed_body())
    arrays = {name: getattr(body, name) for name in body.__dataclass_fields__}
    body = mcmj.Body(**arrays | {"w_fb": 3.0 * body.w_in})
    spec = mujoco.MjSpec.from_string(mcmj.to_mjcf(body))
    names = [actuator.name for actuator in spec.actuators]
    spec.actuator(names[1]).biastype = mujoco.mjtBias.mjBIAS_NONE  # its own law is taken out
    reservoir = mcmj.Reservoir(spec, sensors="*", channels=names[1:], inputs=names[:1])
    return mcmj.Simulation(body, integrator="Euler"), reservoir


def test_a_body_as_a_reservoir_is_worth_the_same(pair):
    one, other = (capacities_of(each, QUICK) for each in pair)
    assert one.measures == pytest.approx(other.measures, abs=1e-9)
    assert one.measures["ipc_total"] > one.measures["memory_capacity"] > 2.0
    np.testing.assert_allclose(one.capacities.values, other.capacities.values, atol=1e-9)


def test_an_offset_drives_as_an_input_does():
    """Of the same actuator; a readout changes nothing, for the feedback is open."""
    driven = [
        sliders(inputs=["m"]),
        sliders(),
        sliders(w_out=np.ones((4, 1))),
        sliders(inputs={"u": {"m": 2.0}}),
    ]
    probes = [QUICK] * 3 + [Probe(**vars(QUICK) | {"strength": 0.5, "channel": "u"})]
    worths = [capacities_of(r, p).measures for r, p in zip(driven, probes, strict=True)]
    assert worths[1:] == [pytest.approx(worths[0], abs=1e-12)] * 3


def test_a_linear_model_has_its_dimension_as_memory_and_no_more():
    """Four states, linear: linear capacities that add up to 4, ranks of 4, nothing of degree 2."""
    long = {"symbols": 4000, "stream_symbols": 50, "shared": 45, "threads": 2}
    worth = capacities_of(sliders(), Probe(**vars(QUICK) | long))
    found = worth.capacities
    assert found.rank == 4
    assert found.of_degree(1) == pytest.approx(4.0, abs=0.05)
    assert found.of_degree(2) < 0.05
    assert worth.kernel_rank == 4
    assert worth.generalisation_rank == 0  # 4.5 s alike, and it forgets at 2 / s


def test_copies_share_what_was_cut_and_start_at_rest(pair):
    simulation = mcmj.Simulation(pair[0].body)
    simulation.alter(cut=(0, 3), masses=np.full(simulation.body.n_nodes, 2.0))
    copies = simulation.with_copies(3, threads=2)
    symbols = np.random.default_rng(0).uniform(-1.0, 1.0, (20, 1))
    alone = held_states(simulation, symbols, 20)
    together = held_states(copies, symbols, 20)
    assert (together == alone).all()
    with pytest.raises(InvalidArgumentError, match="reservoir: expected one without copies, got 3"):
        copies.with_copies(2)
    untouched = mcmj.Simulation(simulation.body)
    assert (held_states(untouched, symbols, 20) != alone).any()


def test_a_file_of_a_reservoir_is_measured_by_the_command(tmp_path):
    path, out = tmp_path / "sliders.xml", tmp_path / "out"
    path.write_text(sliders().to_mjcf())
    options = "--symbols 400 --washout 20 --max-delays 15 5 --streams 20 --stream-symbols 12 "
    main(["capacity", "--reservoir", str(path), *f"{options}--shared 4 --quiet".split(),
          "--out", str(out)])  # fmt: skip
    found = json.loads((out / "metrics.json").read_text())["metrics"]
    wanted = capacities_of(mcmj.Reservoir.open(path), QUICK).measures
    assert {name: found[name] for name in wanted} == wanted
    assert found["n_signals"] == 4
    assert found["maps"] == {}
    assert (out / "capacity.png").stat().st_size > 5000


def test_wrong_arguments(pair, tmp_path):
    with pytest.raises(UnknownNameError, match="channel 'hip'; valid choices: m"):
        driven_channel(sliders(), "hip")
    with pytest.raises(InvalidArgumentError, match="one without copies"):
        capacities_of(sliders(copies=2))
    with pytest.raises(InvalidArgumentError, match="inputs or output channels"):
        capacities_of(mcmj.Simulation(mcmj.random_body(0, n_outputs=0)))
    with pytest.raises(InvalidArgumentError, match="settings: expected none beside a reservoir"):
        Config(reservoir="x.xml", settings=mcmj.core.random_body.BodySettings())
    with pytest.raises(InvalidArgumentError, match="integrator: expected none beside"):
        Config(reservoir="x.xml", integrator="RK4")
    with pytest.raises(BodyFileError):
        mcmj.Reservoir.open(tmp_path / "nowhere.xml")


# --- filters ---------------------------------------------------------------------------------


def test_a_filter_is_learned_as_by_a_body(pair):
    task = delayed_recall(np.random.default_rng(0).uniform(-1.0, 1.0, (700, 1)), 2)
    found = []
    for reservoir in pair:
        reservoir.reset()
        found.append(learn_filter(reservoir, task, slice(50, 500), slice(500, None), hold=100))
    one, other = (each.errors for each in found)
    assert one == pytest.approx(other, abs=1e-9)
    assert one["nrmse_std"] < 0.3 < one["input_only_nrmse_std"]
    assert one["baseline_nrmse_std"] < 1e-12


def test_a_linear_model_recalls_through_its_offset():
    """The error on held-out data is the capacity's: nrmse^2 = 1 - C."""
    task = delayed_recall(np.random.default_rng(0).uniform(-1.0, 1.0, (1500, 1)), 1)
    parts = slice(50, 1000), slice(1000, None)
    found = learn_filter(sliders(), task, *parts, hold=25, driven="offset")
    worth = capacities_of(sliders(), Probe(**vars(QUICK) | {"symbols": 4000, "hold": 0.05}))
    left = 1 - worth.capacities.of(((1, 1),))
    assert found.errors["nrmse_std"] ** 2 == pytest.approx(left, abs=0.05)
    assert left < 0.9


def test_the_switch_is_taught_to_a_reservoir_as_to_a_body(pair):
    config = SwitchConfig(lesson=20.0, exam=20.0, test_pauses=(2.0, 5.0))
    one, other = (learn_switch(config, each, 0) for each in pair)
    assert one.metrics == pytest.approx(other.metrics, rel=1e-6)
