"""What users' models hold, and what is refused: defaults, keyframes, flags, damage, names."""

import mujoco
import numpy as np
import pytest
from models import CHAIN, CHAIN_PARTS

import mcmj
from mcmj import Reservoir
from mcmj.utils.errors import BodyFileError, DivergenceError, InvalidArgumentError, UnknownNameError

SLIDE = (
    "<mujoco>{0}<worldbody><body><joint name='j' type='slide'/><geom size='.1' mass='1'/></body>"
    "</worldbody><actuator><motor name='m' joint='j'/></actuator>{1}</mujoco>"
)
TETHER = """
<mujoco><worldbody><site name="wall" pos="0 0 1"/>
  <body name="a"><joint name="j" type="slide" axis="1 0 0"/><geom size=".1" mass="2"/>
    <site name="s" pos=".1 0 0"/></body>
  <body name="none" pos="0 1 0"/></worldbody>
<tendon><spatial name="t" stiffness="30" damping="1" springlength=".3"><site site="wall"/>
  <site site="s"/></spatial></tendon>
<actuator><motor name="m" joint="j"/><motor name="pull" tendon="t"/></actuator></mujoco>"""


def moved_by(model, ctrl, steps):
    data = mujoco.MjData(model)
    data.ctrl[:] = ctrl
    mujoco.mj_step(model, data, steps)
    return data.qpos.copy()


def test_armature_and_damping_of_defaults_are_not_those_of_channels():
    xml = SLIDE.format("<default><general armature='1' damping='2'/></default>", "")
    run = Reservoir(xml, sensors="jointpos:j", channels=["m"]).rollout(
        offset=np.ones((101, 1)), record=("qpos",)
    )
    wanted = moved_by(mujoco.MjModel.from_xml_string(xml), 1.0, 100)
    assert np.array_equal(run.qpos[-1], wanted)


def test_keyframes_with_controls_come_back():
    xml = SLIDE.format("", "<keyframe><key name='k' qpos='.2' ctrl='.3'/></keyframe>")
    reservoir = Reservoir(xml, sensors="jointpos:j", channels=["m"], w_out=[[-1.0], [0.1]])
    again = Reservoir.open(reservoir.to_mjcf())
    assert np.array_equal(again.rollout(50).signals, reservoir.rollout(50).signals)
    assert again.model.key_ctrl[0, 0] == 0.3


def test_the_kinetic_energy_is_of_the_moment_and_of_the_copy():
    xml = SLIDE.format(
        "<option><flag energy='enable' gravity='disable'/></option>",
        "<sensor><e_kinetic name='e'/></sensor>",
    )
    copies = Reservoir(xml, sensors="e", channels=["m"], copies=2)
    copies.set_state(qvel=[[1.0], [3.0]])
    assert np.allclose(copies.rollout(2).signals[..., 0], [[0.5, 0.5], [4.5, 4.5]], rtol=1e-15)


def test_damage_is_in_the_file_and_in_the_snapshot():
    given = {"sensors": ["jointpos:*", "jointvel:*"], "channels": ["m", "pull"]}
    reservoir = Reservoir(TETHER, **given, w_out=np.full((3, 2), 0.1))
    before = reservoir.snapshot()
    reservoir.alter(masses={"a": 5.0})
    again = Reservoir.open(reservoir.to_mjcf())
    one, other = (r.rollout(500).signals for r in (reservoir, again))
    assert np.abs(one - other).max() < 1e-6 * np.abs(one).max()  # six digits of springs
    assert again.model.body("a").mass[0] == 5.0
    with pytest.raises(InvalidArgumentError, match="snapshot: expected one of this model"):
        reservoir.restore(before)
    reservoir.reset()
    reservoir.alter(cut=("t",))
    loose = Reservoir.open(reservoir.to_mjcf())
    reservoir.set_readout(None)
    loose.set_readout(None)
    pulled = np.tile([0.0, 7.0], (300, 1))  # nothing holds, nothing pulls
    for each in (reservoir, loose):
        assert np.array_equal(each.rollout(offset=pulled, record=("qpos",)).qpos[-1], [0.0])
    with pytest.raises(InvalidArgumentError, match="masses: expected bodies that have a mass"):
        reservoir.alter(masses={"none": 1.0})
    with pytest.raises(InvalidArgumentError, match=r"masses: expected \{name of a body: kg"):
        reservoir.alter(masses=np.ones(3))
    with pytest.raises(InvalidArgumentError, match="cut: expected a tuple of names"):
        reservoir.alter(cut="t")
    body = mcmj.Simulation(mcmj.random_body(0, 5))
    body.alter(cut=(0,))
    with pytest.raises(InvalidArgumentError, match="simulation: expected one that was not altered"):
        body.to_mjcf()


def test_what_has_no_name_gets_one():
    xml = """<mujoco><worldbody><body><joint type="ball"/><geom size=".1"/>
    <body pos="0 0 .3"><joint name="hinge"/><joint name="joint3" axis="1 0 0"/><joint axis="0 1 0"/>
    <geom size=".1"/></body></body></worldbody>
    <actuator><motor joint="hinge"/><motor name="b" joint="joint3"/></actuator>
    <sensor><jointvel joint="hinge"/></sensor></mujoco>"""
    reservoir = Reservoir(xml, sensors=["*", "jointpos:*", "ballquat:*"], channels="*")
    names = ("sensor0", "jointpos:hinge", "jointpos:joint3", "jointpos:joint3_")
    assert reservoir.signal_names == (*names, *(f"ballquat:joint0[{i}]" for i in range(4)))
    assert reservoir.channel_names == ("actuator0", "b")
    assert repr(reservoir) == "Reservoir(8 signals, 2 outputs, 0 inputs, at 0 s)"
    with pytest.raises(InvalidArgumentError, match="jointpos: expected a hinge or slide; of ball"):
        Reservoir(xml, sensors="jointpos:joint0", channels="*")


def test_meshes_are_found_from_any_folder(tmp_path, monkeypatch):
    (tmp_path / "assets").mkdir()
    tetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    (tmp_path / "assets" / "tet.obj").write_text(tetrahedron)
    xml = SLIDE.format(
        "<compiler meshdir='assets'/><asset><mesh name='tet' file='tet.obj'/></asset>", ""
    ).replace("<geom size='.1' mass='1'/>", "<geom type='mesh' mesh='tet'/>")
    (tmp_path / "model.xml").write_text(xml)
    reservoir = Reservoir(tmp_path / "model.xml", sensors="jointpos:j", channels=["m"])
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    (tmp_path / "elsewhere" / "taught.xml").write_text(reservoir.to_mjcf())
    again = Reservoir.open("taught.xml")
    push = np.ones((100, 1))
    one, other = (r.rollout(offset=push).signals for r in (reservoir, again))
    assert np.abs(one - other).max() < 1e-6 * np.abs(one).max()


@pytest.mark.parametrize(
    ("changes", "error", "text"),
    [
        ({"model": None}, InvalidArgumentError, "model: expected MJCF"),
        ({"model": ""}, InvalidArgumentError, "model: expected MJCF"),
        ({"sensors": [3]}, InvalidArgumentError, "sensors: expected a name or pattern"),
        ({"sensors": None}, InvalidArgumentError, "sensors: expected a name or pattern"),
        ({"channels": [0]}, InvalidArgumentError, "channels: expected a name or pattern"),
        (
            {"channels": ["m1", "m*"]},
            InvalidArgumentError,
            "channels: expected every actuator once",
        ),
        (
            {"channels": {"y": ["m1"]}},
            InvalidArgumentError,
            r"channel y: expected \{actuator: gain",
        ),
        ({"channels": {"y": {}}}, InvalidArgumentError, r"channel y: expected \{actuator: gain"),
        ({"integrator": "leapfrog"}, InvalidArgumentError, "integrator: expected one of MuJoCo's"),
        ({"copies": -1}, InvalidArgumentError, "copies: expected an integer"),
        ({"copies": 2.5}, InvalidArgumentError, "copies: expected an integer"),
        (
            {"model": CHAIN.replace('name="m1"', 'name="mcmj:output:m2"')},
            InvalidArgumentError,
            "no name that begins with 'mcmj:', got mcmj:output:m2",
        ),
        (
            {
                "model": CHAIN.replace(
                    "/><worldbody>", '><flag sensor="disable"/></option><worldbody>'
                )
            },
            InvalidArgumentError,
            "model: expected sensors that are on",
        ),
    ],
)
def test_what_cannot_be_a_reservoir_is_refused(changes, error, text):
    given = {"model": CHAIN, **CHAIN_PARTS} | changes
    with pytest.raises(error, match=text):
        Reservoir(given.pop("model"), **given)


def test_a_delay_on_top_of_a_sensors_own_is_refused():
    xml = CHAIN.replace(
        "</mujoco>", "<sensor><clock name='c' delay='.01' nsample='9'/></sensor></mujoco>"
    )
    assert Reservoir(xml, sensors="c", channels=["m1"]).rollout(5).signals.shape == (5, 1)
    with pytest.raises(InvalidArgumentError, match="feedback_delay: expected 0 with a sensor"):
        Reservoir(xml, sensors="c", channels=["m1"], feedback_delay=1)


def test_other_files_and_states_are_refused(tmp_path):
    reservoir = Reservoir(CHAIN, **CHAIN_PARTS)
    with pytest.raises(BodyFileError, match=r"not the file of a reservoir .* makes one"):
        Reservoir.open(CHAIN)
    with pytest.raises(UnknownNameError, match="unknown body 'world'"):
        reservoir.rollout(5, forces={"world": (0, 0, 1)})
    with pytest.raises(InvalidArgumentError, match="reservoir: expected one without copies"):
        reservoir.with_copies(2).to_mjcf()
    with pytest.raises(InvalidArgumentError, match="simulation: expected one without copies"):
        mcmj.teach(reservoir.with_copies(2), mcmj.target("lissajous"), mcmj.Teaching(), seed=0)
    with pytest.raises(InvalidArgumentError, match="target: expected a Target"):
        mcmj.teach(reservoir, "lissajous", mcmj.Teaching(), seed=0)
    with pytest.raises(InvalidArgumentError, match="path: expected a name that ends with"):
        mcmj.film(reservoir, tmp_path / "film.png")
    huge = np.full((10, 2), 1e11)
    with pytest.raises(DivergenceError, match=r"at actuator 'm\d' \(control 1e\+11\)"):
        reservoir.rollout(offset=huge)
    assert reservoir.rollout(3, record="qpos").qpos.shape == (3, 2)


def test_phases_have_names_and_freeze_channels_by_name():
    w_out = np.random.default_rng(0).normal(size=(5, 2)) / 50
    runs = []
    for frozen in ((1,), ("m2",)):
        reservoir = Reservoir(CHAIN, **CHAIN_PARTS)
        reservoir.set_state(qvel=[1.0, -2.0])
        switch = mcmj.Phase(0.2, w_out=reservoir.readout, name="none")
        phases = [mcmj.Phase(0.2, w_out=w_out), mcmj.Phase(0.2, freeze=frozen, name="held"), switch]
        run = mcmj.run_schedule(reservoir, phases, seed=0)
        runs.append(run.feedback)
        assert run.phase("held") == run.phase(1) == slice(100, 200)
        assert not run.feedback[run.phase("none")].any()
    assert np.array_equal(*runs)
    with pytest.raises(UnknownNameError, match="unknown channel 'm3'; valid choices: m1, m2"):
        mcmj.run_schedule(reservoir, [mcmj.Phase(0.2, freeze=("m3",))], seed=0)
    with pytest.raises(InvalidArgumentError, match="phase: expected a name, or a number from 0"):
        run.phase(5)
