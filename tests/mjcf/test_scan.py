"""The scan of body files: refused at once, in one line, before MuJoCo sees the text."""

import os
import re
from contextlib import suppress

import numpy as np
import pytest

import mcmj
from mcmj.core.integrators import INTEGRATORS
from mcmj.mjcf.kept import provenance_of_model, settings_of_model
from mcmj.mjcf.read import body_of_model, load_model
from mcmj.utils.errors import BodyFileError

BODY = mcmj.to_mjcf(mcmj.random_body(0, 5), w_out=None)
WORLD = "<worldbody>"
HOSTILE = {
    "include": BODY.replace(WORLD, '<include file="other.xml"/>' + WORLD, 1),
    "mesh file": BODY.replace("<asset>", '<asset><mesh name="m" file="m.stl"/>', 1),
    "texture file": BODY.replace("<asset>", '<asset><texture type="2d" file="t.png"/>', 1),
    "doctype": '<!DOCTYPE a [<!ENTITY b "c">]>' + BODY,
    "replicate": BODY.replace(WORLD, WORLD + '<replicate count="100000"/>', 1),
    "memory": BODY.replace(WORLD, '<size memory="11G"/>' + WORLD, 1),
    "nuser": BODY.replace(WORLD, '<size nuser_tendon="500000000"/>' + WORLD, 1),
    "nkey": BODY.replace(WORLD, '<size nkey="500000000"/>' + WORLD, 1),
    "texture size": BODY.replace('height="24"', 'height="500000000"', 1),
    "nested": "<mujoco>" + "<a>" * 100_000,
    "not XML": "<mujoco",
    "null": BODY + "\0",
    "surrogate": BODY + "\ud800",
    "nan count": BODY.replace(WORLD, '<size nkey="nan"/>' + WORLD, 1),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_what_a_body_file_may_not_ask_for(name):
    assert HOSTILE[name] != BODY
    with pytest.raises(BodyFileError) as caught:
        load_model(HOSTILE[name])
    assert "\n" not in str(caught.value)
    assert "cannot compile" not in str(caught.value)  # MuJoCo never saw it


def test_a_user_can_raise_the_limit():
    with pytest.raises(BodyFileError, match="max_bytes"):
        load_model(BODY, max_bytes=1000)
    large = BODY.replace(WORLD, '<size nuserdata="20000000"/>' + WORLD, 1)
    with pytest.raises(BodyFileError, match="max_bytes"):
        load_model(large)
    assert load_model(large, max_bytes=2**30).nuserdata == 20_000_000


def test_only_regular_files_in_utf_8_are_read(tmp_path):
    os.mkfifo(tmp_path / "fifo.xml")
    (tmp_path / "latin.xml").write_bytes(BODY.encode() + b"<!-- \xe9 -->")
    with pytest.raises(BodyFileError, match="regular file"):
        load_model(tmp_path / "fifo.xml")
    with pytest.raises(BodyFileError, match=r"no such|regular"):
        load_model(tmp_path)
    with pytest.raises(BodyFileError, match="UTF-8"):
        load_model(tmp_path / "latin.xml")


@pytest.mark.parametrize("digits", ["7", "9" * 5000])
def test_a_joint_of_a_node_that_is_not_there(digits):
    body = mcmj.random_body(0, 5)
    text = mcmj.to_mjcf(body)
    pushed = next(i for i in body.free if body.w_in[i].any() or body.w_fb[i].any())
    with pytest.raises(BodyFileError, match="tendon"):
        body_of_model(load_model(text.replace(f'"n{pushed}x"', f'"n{digits}x"')))


@pytest.mark.parametrize("account", ["{", "[1]", "[" * 20_000])
def test_a_provenance_that_is_not_a_json_object(account):
    custom = f'<custom><text name="provenance" data="{account}"/></custom>'
    with pytest.raises(BodyFileError, match="provenance"):
        provenance_of_model(load_model(BODY.replace(WORLD, custom + WORLD, 1)))


@pytest.mark.parametrize("value", ["nan", "1e308", "9" * 5000])
@pytest.mark.parametrize("name", ["mass", "stiffness", "springlength"])
def test_numbers_out_of_range_leave_one_line_and_no_log(name, value, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = re.sub(f'{name}="[^"]*"', f'{name}="{value}"', BODY, count=1)
    assert text != BODY
    with suppress(BodyFileError):  # nothing else: no warning of NumPy's, no raw error
        mcmj.from_mjcf(text)
    assert not list(tmp_path.iterdir())


OPTION = 'gravity="0 0 0"'
UNSAID = {
    "gravity": (OPTION, 'gravity="0 0 -9.81"'),
    "wind": (OPTION, OPTION + ' wind="1 0 0"'),
    "viscosity": (OPTION, OPTION + ' viscosity="1"'),
    "dof_damping": ('axis="1 0 0"', 'axis="1 0 0" damping="1"'),
    "jnt_stiffness": ('axis="1 0 0"', 'axis="1 0 0" stiffness="1"'),
    "jnt_limited": ('axis="1 0 0"', 'axis="1 0 0" limited="true" range="-1 1"'),
    "jnt_axis of joint 'n": ('type="slide" axis="1 0 0"', 'type="hinge" axis="0 0 1"'),
    "qpos0 of joint": ('axis="1 0 0"', 'axis="1 0 0" ref="1"'),
    "geom_contype": ("</worldbody>", '<geom type="sphere" size="1"/></worldbody>'),
    "body ''": ("</worldbody>", "<body/></worldbody>"),
    "gear": ("<motor ", '<motor gear="2" '),
    "actuator 'more'": ("</actuator>", '<motor name="more" tendon="s0"/></actuator>'),
    "sensor 'more'": ("</sensor>", '<tendonvel name="more" tendon="s0"/></sensor>'),
    "tendon_lengthspring of tendon 's0'": ('springlength="', 'springlength="0.01 '),
    "tendon_stiffness of tendon 'in0'": ('<fixed name="in0"', '<fixed name="in0" stiffness="1"'),
    "tendon_damping of tendon 'in0'": ('<fixed name="in0"', '<fixed name="in0" damping="1"'),
    "actuator_gainprm of actuator 'fb0'": ('biastype="user"', 'biastype="user" gainprm="2"'),
    "actuator_biasprm of actuator 'in0'": ("<motor ", '<general biastype="affine" biasprm="1" '),
    "body_pos": (' 0.0">', ' 1.0">'),
    "enableflags": ("<flag ", '<flag sleep="enable" '),
    "disables springs": ("<flag ", '<flag spring="disable" '),
}  # fmt: skip


@pytest.mark.parametrize("name", UNSAID)
def test_what_a_body_cannot_say_is_refused_by_name(name):
    old, new = UNSAID[name]
    given = mcmj.to_mjcf(mcmj.random_body(0, 5, n_inputs=1))
    text = given.replace(old, new, 1)
    assert text != given
    with pytest.raises(BodyFileError, match=name):
        mcmj.from_mjcf(text)


@pytest.mark.parametrize("axis", "xy")
def test_a_node_that_slides_along_one_axis_only_is_refused(axis):
    given = mcmj.to_mjcf(mcmj.random_body(0, 5, n_outputs=0, n_inputs=0))
    text = re.sub(rf'<joint name="n[0-9]+{axis}"[^>]*>', "", given, count=1)
    assert text != given
    with pytest.raises(BodyFileError, match=rf"joint 'n[0-9]+{axis}'"):
        mcmj.from_mjcf(text)


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("springs", ["native", "cubic", "tansig"])
@pytest.mark.parametrize(("delay", "period"), [(0, 0), (2e-3, 0), (0, 4e-3), (8e-3, 4e-3)])
def test_whatever_mcmj_writes_is_read(integrator, springs, delay, period):
    body = mcmj.random_body(0, 5, n_inputs=1)
    w_out = np.ones((body.n_springs + 1, body.n_outputs))
    text = mcmj.to_mjcf(
        body, timestep=1e-3 / 3, integrator=integrator, springs=springs, w_out=w_out,
        feedback_delay=delay, control_period=period, readouts={"a": w_out},
    )  # fmt: skip
    assert mcmj.from_mjcf(text)[0] == body
    settings = settings_of_model(load_model(text))
    assert (settings["integrator"], settings["springs"]) == (integrator, springs)
    assert settings["timestep"] == (period or 1e-3 / 3)
    assert settings["feedback_delay"] == round(delay / settings["timestep"])
    assert settings["substeps"] == (12 if period else 1)
