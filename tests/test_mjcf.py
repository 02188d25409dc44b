"""Body <-> MJCF: exact to the bit, nothing superfluous, and readable by others."""

import json
import xml.etree.ElementTree as ET

import mujoco
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import mcmj
from mcmj import Body, from_mjcf, to_mjcf
from mcmj.bodyfile import (
    load_model,
    provenance_of_model,
    readouts_of_model,
    spring_law_of_model,
)
from mcmj.errors import BodyFileError, InvalidArgumentError, UnknownNameError
from mcmj.mjcf import INTEGRATORS

FIELDS = tuple(Body.__dataclass_fields__)


def same_bits(one, other):
    return all(
        getattr(one, name).dtype == getattr(other, name).dtype
        and getattr(one, name).shape == getattr(other, name).shape
        and getattr(one, name).tobytes() == getattr(other, name).tobytes()
        for name in FIELDS
    )


def reals(low, high):
    # adding 0.0 turns -0.0 into 0.0
    return st.floats(low, high, allow_subnormal=False).map(lambda x: x + 0.0)


@st.composite
def bodies(draw):
    """Any valid body: a random tree of springs and some more, any numbers, any fixed nodes."""
    n = draw(st.integers(2, 6))
    positions = draw(arrays(float, (n, 2), elements=reals(-1e5, 1e5), unique=True))
    tree = {(draw(st.integers(0, i - 1)), i) for i in range(1, n)}
    pairs = st.tuples(st.integers(0, n - 1), st.integers(0, n - 1))
    more = {tuple(sorted(p)) for p in draw(st.sets(pairs, max_size=4)) if p[0] != p[1]}
    springs = np.array(draw(st.permutations(sorted(tree | more))))
    flipped = draw(arrays(bool, len(springs)))
    springs[flipped] = springs[flipped][:, ::-1]
    fixed = draw(arrays(bool, n).filter(lambda f: not f.all()))
    channels = st.integers(0, 2)
    weights = st.one_of(st.just(0.0), reals(-1e3, 1e3), reals(-1e-300, 1e-300))
    positive, from_zero = reals(1e-6, 1e6), st.one_of(st.just(0.0), reals(1e-9, 1e9))
    return Body(
        positions=positions,
        springs=springs,
        fixed=fixed,
        rest_lengths=draw(arrays(float, len(springs), elements=positive)),
        masses=draw(arrays(float, n, elements=positive)),
        w_in=draw(arrays(float, (n, draw(channels)), elements=weights)),
        w_fb=draw(arrays(float, (n, draw(channels)), elements=weights)),
        k1=draw(arrays(float, len(springs), elements=positive)),
        d1=draw(arrays(float, len(springs), elements=positive)),
        k3=draw(arrays(float, len(springs), elements=from_zero)),
        d3=draw(arrays(float, len(springs), elements=from_zero)),
    )


def readouts(body, rows):
    return arrays(float, (rows, body.n_outputs), elements=reals(-1e9, 1e9))


# --- round trip ------------------------------------------------------------------------------


@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow])
@given(
    data=st.data(),
    body=bodies(),
    springs=st.sampled_from(["native", "cubic", "tansig"]),
    bias=st.booleans(),
    with_readout=st.booleans(),
)
def test_round_trip_is_exact_to_the_bit(data, body, springs, bias, with_readout):
    w_out = data.draw(readouts(body, body.n_springs + bias)) if with_readout else None
    again, w_again = from_mjcf(to_mjcf(body, w_out=w_out, springs=springs))
    assert same_bits(again, body)
    if w_out is None or body.n_outputs == 0:
        assert w_again is None
    else:
        assert w_again.tobytes() == w_out.tobytes()
        assert w_again.shape == w_out.shape


def test_round_trip_of_the_test_body_keeps_what_fixed_nodes_carry(body):
    assert body.w_fb[body.fixed].all()
    assert (body.masses[body.fixed] != 1.0).all()
    assert same_bits(from_mjcf(to_mjcf(body))[0], body)


def test_writing_again_gives_the_same_text(body, w_bias):
    text = to_mjcf(body, w_out=w_bias)
    assert to_mjcf(*from_mjcf(text)[:1], w_out=from_mjcf(text)[1]) == text


def test_a_file_reads_like_its_text(tmp_path, body, w_out):
    path = tmp_path / "body.xml"
    path.write_text(to_mjcf(body, w_out=w_out))
    for source in (path, str(path), "\n  " + path.read_text()):
        again, w_again = from_mjcf(source)
        assert same_bits(again, body)
        assert w_again.tobytes() == w_out.tobytes()


def test_named_readouts_are_kept(body, w_out, w_bias):
    text = to_mjcf(body, readouts={"van_der_pol": w_out, "with bias/2": w_bias})
    kept = readouts_of_model(load_model(text))
    assert kept.keys() == {"van_der_pol", "with bias/2"}
    assert np.array_equal(kept["van_der_pol"], w_out)
    assert np.array_equal(kept["with bias/2"], w_bias)
    assert from_mjcf(text)[1] is None


def test_named_readouts_of_a_large_body_are_kept():
    """Custom numeric fields of MJCF hold at most 500 numbers."""
    body = mcmj.random_body(0, nodes=120)
    w_out = np.random.default_rng(0).normal(size=(body.n_springs, 2))
    assert w_out.size > 500
    kept = readouts_of_model(load_model(to_mjcf(body, readouts={"a": w_out})))
    assert np.array_equal(kept["a"], w_out)


def test_readout_of_a_large_body_is_kept():
    body = mcmj.random_body(0, nodes=300)
    w_out = np.random.default_rng(0).normal(size=(body.n_springs, 2))
    again, w_again = from_mjcf(to_mjcf(body, w_out=w_out))
    assert same_bits(again, body)
    assert np.array_equal(w_again, w_out)


def test_many_fixed_nodes_keep_their_masses_and_weights():
    n = 600
    x = np.arange(n, dtype=float)
    body = Body(
        positions=np.column_stack([x, np.zeros(n)]),
        springs=np.column_stack([np.arange(n - 1), np.arange(1, n)]),
        **{name: np.ones(n - 1) for name in ("k1", "k3", "d1", "d3")},
        fixed=x > 0,
        masses=1.0 + x,
        w_fb=np.column_stack([x, -x]),
    )
    assert same_bits(from_mjcf(to_mjcf(body))[0], body)


accounts = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
)


@settings(max_examples=20)
@given(account=st.dictionaries(st.text(), accounts, max_size=4))
def test_provenance_is_kept(oscillator, account):
    assert provenance_of_model(load_model(to_mjcf(oscillator, provenance=account))) == account


def test_no_provenance(body):
    assert provenance_of_model(load_model(to_mjcf(body))) is None


def test_provenance_that_is_not_json_is_a_named_error(body):
    with pytest.raises(InvalidArgumentError, match="provenance"):
        to_mjcf(body, provenance={"made by": object()})


@pytest.mark.parametrize("law", ["native", "cubic", "tansig"])
def test_spring_law_is_kept(body, law):
    assert spring_law_of_model(load_model(to_mjcf(body, springs=law))) == law


# --- the model -------------------------------------------------------------------------------


@pytest.mark.parametrize("integrator", ["Euler", "RK4", "implicit", "implicitfast", "discrete"])
def test_nothing_superfluous_in_the_model(body, w_out, integrator):
    model = load_model(to_mjcf(body, w_out=w_out, timestep=5e-4, integrator=integrator))
    free = body.n_nodes - 2
    assert model.nv == model.nq == model.njnt == 2 * free
    assert model.nbody == 1 + free
    assert model.nsite == body.n_nodes
    assert model.ntendon == body.n_springs + body.n_inputs + body.n_outputs
    assert model.nsensor == body.n_springs
    assert model.nu == body.n_inputs + body.n_outputs
    assert model.na == model.ngeom == model.neq == model.nmesh == model.nkey == 0
    assert not model.opt.gravity.any()
    for flag in (mujoco.mjtDisableBit.mjDSBL_CONTACT, mujoco.mjtDisableBit.mjDSBL_CONSTRAINT):
        assert model.opt.disableflags & flag
    assert model.opt.timestep == 5e-4
    assert mujoco.mjtIntegrator(model.opt.integrator).name.lower() == f"mjint_{integrator}".lower()
    data = mujoco.MjData(model)
    data.qvel[:] = 1.0
    mujoco.mj_step(model, data)
    assert data.ncon == data.nefc == 0


def test_readout_lives_in_the_feedback_actuators(body, w_bias):
    """The contract of design.md, section 2: weights in user data, gate in biasprm[0]."""
    model = load_model(to_mjcf(body, w_out=w_bias))
    for channel in range(body.n_outputs):
        actuator = model.actuator(f"fb{channel}")
        assert np.array_equal(actuator.user, w_bias[:, channel])
        assert actuator.biastype[0] == mujoco.mjtBias.mjBIAS_USER
        assert actuator.biasprm[0] == 1.0
        assert actuator.gainprm[0] == 1.0
    opened = load_model(to_mjcf(body))
    assert opened.actuator("fb0").biasprm[0] == 0.0


def test_sensors_measure_the_springs_at_the_start(body):
    model = load_model(to_mjcf(body))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.sensordata == pytest.approx(body.rest_lengths, rel=1e-15)


def test_colours_follow_the_paper(body):
    model = load_model(to_mjcf(body))
    for node in range(body.n_nodes):
        r, g, b, _ = model.site(f"n{node}").rgba
        kind = model.site(f"n{node}").type[0]
        if body.fixed[node]:
            assert kind == mujoco.mjtGeom.mjGEOM_BOX
            assert r > 0.8 > 0.2 > max(g, b)
        elif body.w_fb[node].any():
            assert b > g or g > r  # purple or aqua
        elif body.w_in[node].any():
            assert g > max(r, b)
        else:
            assert r == g == b


def test_steps_in_dm_control_as_in_mujoco(body):
    dm_mujoco = pytest.importorskip("dm_control.mujoco")
    text = to_mjcf(body)
    physics = dm_mujoco.Physics.from_xml_string(text)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    controls = np.random.default_rng(0).normal(size=(200, model.nu))
    for control in controls:
        physics.set_control(control)
        data.ctrl[:] = control
        physics.step()
        mujoco.mj_step(model, data)
    assert np.abs(data.qpos).max() > 1e-3
    assert physics.data.qpos.tobytes() == data.qpos.tobytes()
    assert physics.data.qvel.tobytes() == data.qvel.tobytes()


# --- errors ----------------------------------------------------------------------------------


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


def test_unknown_integrator_lists_the_names(body):
    with pytest.raises(UnknownNameError, match="'rk45'") as caught:
        to_mjcf(body, integrator="rk45")
    assert caught.value.choices == sorted(INTEGRATORS)
    for name in INTEGRATORS:
        assert name in str(caught.value)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("timestep", 0.0),
        ("timestep", np.nan),
        ("feedback_delay", -1e-3),
        ("control_period", np.inf),
        ("w_out", np.zeros((3, 2))),
        ("w_out", [1.0, 2.0]),
    ],
)
def test_bad_arguments_are_named(body, name, value):
    with pytest.raises(InvalidArgumentError) as caught:
        to_mjcf(body, **{name: value})
    assert caught.value.name == name


def test_wrong_readout_names_both_shapes(body):
    n = body.n_springs
    with pytest.raises(InvalidArgumentError) as caught:
        to_mjcf(body, w_out=np.zeros((n - 1, 2)))
    assert str(caught.value) == (
        f"w_out: expected {n} rows (or {n + 1} with a bias), got shape ({n - 1}, 2)"
    )
    with pytest.raises(InvalidArgumentError, match=r"^mine: "):
        to_mjcf(body, readouts={"mine": np.full((n, 2), np.nan)})


def test_provenance_is_readable_without_mcmj(body):
    """It is plain JSON in a text element."""
    root = ET.fromstring(to_mjcf(body, provenance={"seed": 7, "by": 'a "name" & more'}))
    text = root.find("custom/text[@name='provenance']").get("data")
    assert json.loads(text) == {"seed": 7, "by": 'a "name" & more'}
