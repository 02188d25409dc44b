"""Files that are no bodies: garbage, other models, damaged ones."""

import xml.etree.ElementTree as ET

import mujoco
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mcmj import Body, from_mjcf, to_mjcf
from mcmj.mjcf.read import load_model, readouts_of_model
from mcmj.utils.errors import BodyFileError


@pytest.mark.parametrize(
    "source",
    [
        "garbage",
        "",
        "/no/such/file.xml",
        "/",
        "x" * 5000,
        "a\0b",
        "<garbage>",
        "<mujoco",
        "<mujoco/>",
        "<mujoco><worldbody><body name='n0'/></worldbody></mujoco>",
    ],
)
def test_garbage_is_a_body_file_error(source):
    with pytest.raises(BodyFileError):
        from_mjcf(source)


@pytest.mark.parametrize("content", [b"", b"garbage", bytes(range(256)), b"<mujoco/>"])
def test_a_bad_file_is_named(tmp_path, content):
    path = tmp_path / "bad.xml"
    path.write_bytes(content)
    with pytest.raises(BodyFileError):
        from_mjcf(path)


ANOTHER = """
<mujoco>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 1"/>
    <site name="n0"/>
    <body><freejoint/><geom size=".1"/><site name="n1" pos="1 0 0"/></body>
    <body>
      <joint name="hinge"/><geom size=".1"/><site name="n2" pos="2 0 0"/><site name="other"/>
    </body>
  </worldbody>
  {}
</mujoco>"""
SPRING = "<spatial name='s{}' stiffness='1' damping='1' springlength='1'>{}</spatial>"


@pytest.mark.parametrize(
    "tendons",
    [
        "",
        SPRING.format("", "<site site='n0'/><site site='n1'/>"),
        SPRING.format(0, "<site site='n0'/><site site='other'/>"),
        SPRING.format(0, "<site site='n0'/><site site='n1'/><site site='n2'/>"),
        SPRING.format(0, "<site site='n0'/><site site='n1'/>"),  # n2 hangs in the air
        "<spatial name='s0'><site site='n0'/><site site='n1'/></spatial>"
        "<spatial name='s1'><site site='n1'/><site site='n2'/></spatial>",  # no stiffness
        "<fixed name='s0'><joint joint='hinge' coef='1'/></fixed>",
        SPRING.format(0, "<site site='n0'/><site site='n1'/>")
        + SPRING.format(1, "<site site='n1'/><site site='n2'/>")
        + "<fixed name='in0'><joint joint='hinge' coef='1'/></fixed>",
        SPRING.format(0, "<site site='n0'/><site site='n1'/>")
        + SPRING.format(1, "<site site='n1'/><site site='n2'/>")
        + "<spatial name='in0'><site site='n1'/><site site='n2'/></spatial>",
    ],
)
def test_other_models_are_refused(tendons):
    text = ANOTHER.format(f"<tendon>{tendons}</tendon>")
    mujoco.MjModel.from_xml_string(text)  # MuJoCo takes it, mcmj must not
    with pytest.raises(BodyFileError):
        from_mjcf(text)


@settings(max_examples=120)
@given(data=st.data())
def test_a_damaged_file_is_a_body_or_a_body_file_error(data, body, w_bias):
    """One element removed, doubled, or one of its attributes lost or changed."""
    root = ET.fromstring(to_mjcf(body, w_out=w_bias, readouts={"a": w_bias}))
    parents = [e for e in root.iter() if len(e)]
    parent = data.draw(st.sampled_from(parents))
    child = data.draw(st.sampled_from(list(parent)))
    how = data.draw(st.sampled_from(["remove", "double", "drop", "change"]))
    if how == "remove":
        parent.remove(child)
    elif how == "double":
        parent.append(child)
    elif child.attrib:
        key = data.draw(st.sampled_from(sorted(child.attrib)))
        child.attrib.pop(key)
        if how == "change":
            child.set(key, data.draw(st.sampled_from(["", "1", "1 2 3", "-1", "n0", "s0", "nan"])))
    text = ET.tostring(root, encoding="unicode")
    try:
        again, _ = from_mjcf(text)
        readouts_of_model(load_model(text))
    except BodyFileError:
        return
    assert isinstance(again, Body)


@pytest.mark.parametrize("keep", [0, 1])
def test_readouts_that_fit_no_channel_are_a_body_file_error(body, w_out, keep):
    """Someone took feedback actuators out of the file: 16 x 2 numbers for 0 or 1 outputs."""
    root = ET.fromstring(to_mjcf(body, readouts={"a": w_out}))
    actuators = root.find("actuator")
    for general in actuators.findall("general")[keep:]:
        actuators.remove(general)
    with pytest.raises(BodyFileError):
        readouts_of_model(load_model(ET.tostring(root, encoding="unicode")))
