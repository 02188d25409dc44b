"""Body -> MJCF. A body file is a complete program: geometry, springs, weights, readout.

Names in the file: body, joints and site of node i are n<i>, n<i>x, n<i>y (and n<i>z, of a body
in space) and n<i>; spring j
is the spatial tendon s<j> with the length sensor length<j>; input and feedback channel c are
the actuators in<c> and fb<c> on fixed tendons of the same names. Fixed nodes are sites of
the world: they have no joints. Numbers are written with 17 digits, so reading gives back
the same bits.
"""

import json
import xml.etree.ElementTree as ET
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from mcmj.core.body import Body
from mcmj.core.callbacks.leapfrog import userdata_size
from mcmj.core.callbacks.pointers import TAG
from mcmj.core.callbacks.spring_laws import SpringLaw, spring_law
from mcmj.core.integrators import DEFAULT_INTEGRATOR, Integrator, integrator_named
from mcmj.core.readout import checked_readout
from mcmj.core.space import AXES
from mcmj.mjcf.appearance import add_appearance, node_style
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, require_number

READOUT_PREFIX = "readout/"
JOINTS = tuple(zip(AXES, ("1 0 0", "0 1 0", "0 0 1"), strict=True))


def to_mjcf(
    body: Body,
    *,
    timestep: float = 1e-3,
    integrator: str = DEFAULT_INTEGRATOR,
    w_out: object = None,
    readouts: Mapping[str, object] | None = None,
    springs: str | SpringLaw = "native",
    feedback_delay: float = 0.0,
    control_period: float = 0.0,
    provenance: Mapping[str, object] | None = None,
) -> str:
    """Write a body as one self-contained MJCF model.

    Args:
        body: the body.
        timestep: physics step [s].
        integrator: a name of mcmj.core.integrators. Without mcmj's callbacks, as in MuJoCo's stock
            viewer, the file runs under the row's `mujoco_name`: leapfrog is then Euler.
        w_out: readout (L, n_outputs), or (L + 1, n_outputs) with a bias in the last row. With
            one the loop is closed wherever mcmj's callbacks are installed; else it is open.
        readouts: more readouts by name, kept in the file; see `readouts_of_model`.
        springs: "native" for MuJoCo's polynomial springs, or a law run by a callback.
        feedback_delay: delay of the sensors that the readout reads [s].
        control_period: if above 0, those sensors sample at this period and hold [s].
        provenance: JSON-able account of where the body comes from, kept in the file.

    Raises:
        InvalidArgumentError, UnknownNameError: an argument out of bounds.
    """
    require_number("timestep", timestep, 0.0, open_low=True)
    require_number("feedback_delay", feedback_delay, 0.0)
    require_number("control_period", control_period, 0.0)
    scheme = integrator_named(integrator)
    root = ET.Element("mujoco", model="mcmj body")
    _add_options(root, body, timestep, scheme)
    add_appearance(root, body)
    if readouts and body.n_outputs == 0:
        raise InvalidArgumentError("readouts", "none for a body without outputs", list(readouts))
    checked = {name: checked_readout(body, w, name) for name, w in (readouts or {}).items()}
    _add_custom(root, body, checked, scheme, spring_law(springs), provenance)
    _add_nodes(root, body)
    tendons = ET.SubElement(root, "tendon")
    _add_springs(tendons, body, spring_law(springs))
    actuators = ET.SubElement(root, "actuator")
    active = None if w_out is None else checked_readout(body, w_out)
    _add_channels(tendons, actuators, body, active, delayed=feedback_delay > 0)
    _add_sensors(root, body, timestep, feedback_delay, control_period)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def numbers(values: npt.ArrayLike) -> str:
    """Numbers as MJCF text, exact to the bit."""
    return " ".join(repr(float(v)) for v in np.asarray(values).ravel())


def _json(provenance: Mapping[str, object]) -> str:
    try:
        return json.dumps(provenance)
    except (TypeError, ValueError) as error:
        raise InvalidArgumentError("provenance", "JSON values", error) from error


def _add_options(root: ET.Element, body: Body, timestep: float, scheme: Integrator) -> None:
    option = ET.SubElement(
        root,
        "option",
        timestep=numbers(timestep),
        gravity="0 0 0",
        integrator=scheme.mujoco_name,
    )
    if scheme.by_callback:
        ET.SubElement(root, "size", nuserdata=str(userdata_size(body.dimensions * len(body.free))))
    # no contacts, limits or equalities: skip the whole constraint machinery; and keep a state
    # that blew up for the error message instead of resetting it silently
    ET.SubElement(option, "flag", constraint="disable", contact="disable", autoreset="disable")


def _add_custom(
    root: ET.Element,
    body: Body,
    readouts: Mapping[str, Array],
    scheme: Integrator,
    law: SpringLaw | None,
    provenance: Mapping[str, object] | None,
) -> None:
    """What MJCF has no place for: masses and weights of fixed nodes, more readouts, .."""
    custom = ET.Element("custom")  # as text: a numeric takes 500 numbers at most
    if scheme.by_callback:
        ET.SubElement(custom, "numeric", name=scheme.name, data=numbers(TAG))
    for name in ("masses", "w_in", "w_fb"):
        values = getattr(body, name)[body.fixed]
        if values.size and (values != (1.0 if name == "masses" else 0.0)).any():
            ET.SubElement(custom, "text", name=f"fixed_{name}", data=numbers(values))
    if not body.pushed_along_x:  # coefficients of joints are products, rounded
        for name in ("direction", "w_in", "w_fb"):
            if getattr(body, name).size:
                ET.SubElement(custom, "text", name=name, data=numbers(getattr(body, name)))
    for name, readout in readouts.items():
        ET.SubElement(custom, "text", name=READOUT_PREFIX + name, data=numbers(readout))
    if law is not None:
        ET.SubElement(custom, "text", name="spring_law", data=law.name)
    if provenance is not None:
        ET.SubElement(custom, "text", name="provenance", data=_json(provenance))
    if len(custom):
        root.append(custom)


def _add_nodes(root: ET.Element, body: Body) -> None:
    world = root.find("worldbody")
    assert world is not None
    for i, position in enumerate(body.positions):
        place = {"name": f"n{i}", "pos": numbers([*position, 0.0][:3])}
        if body.fixed[i]:
            ET.SubElement(world, "site", place | node_style(body, i))
            continue
        node = ET.SubElement(world, "body", place)
        # MuJoCo wants an inertia, which a node without rotation never uses
        ET.SubElement(
            node, "inertial", pos="0 0 0", mass=numbers(body.masses[i]), diaginertia="1 1 1"
        )
        for name, axis in JOINTS[: body.dimensions]:
            ET.SubElement(node, "joint", name=f"n{i}{name}", type="slide", axis=axis)
        ET.SubElement(node, "site", node_style(body, i), name=f"n{i}")


def _add_springs(tendons: ET.Element, body: Body, law: SpringLaw | None) -> None:
    for j, (a, b) in enumerate(body.springs):
        k1, k3, d1, d3 = body.k1[j], body.k3[j], body.d1[j], body.d3[j]
        if law is None:
            physics = {
                "stiffness": numbers([k1, 0, k3]),
                "damping": numbers([d1, 0, d3]),
                "springlength": numbers(body.rest_lengths[j]),
            }
        else:
            # the law's key is filled in at run time; 0 in a file means "not connected"
            physics = {"user": numbers([law.tag, 0, body.rest_lengths[j], k1, k3, d1, d3])}
        spatial = ET.SubElement(tendons, "spatial", {"name": f"s{j}"} | physics)
        ET.SubElement(spatial, "site", site=f"n{a}")
        ET.SubElement(spatial, "site", site=f"n{b}")


def _add_channels(
    tendons: ET.Element, actuators: ET.Element, body: Body, w_out: Array | None, *, delayed: bool
) -> None:
    for c in range(body.n_inputs):
        _add_push(tendons, f"in{c}", body, body.w_in[:, c])
        ET.SubElement(actuators, "motor", name=f"in{c}", tendon=f"in{c}")
    for c in range(body.n_outputs):
        _add_push(tendons, f"fb{c}", body, body.w_fb[:, c])
        channel = {
            "name": f"fb{c}",
            "tendon": f"fb{c}",
            "biastype": "user",
            "biasprm": numbers([float(w_out is not None), TAG, 0, body.n_springs, delayed]),
        }
        if w_out is not None:
            channel["user"] = numbers(w_out[:, c])
        ET.SubElement(actuators, "general", channel)


def _add_push(tendons: ET.Element, name: str, body: Body, weights: Array) -> None:
    """A fixed tendon whose unit force is the channel's weight times `direction` on free nodes."""
    fixed = ET.SubElement(tendons, "fixed", name=name)
    pushed = [i for i in body.free if weights[i] != 0.0] or [body.free[0]]
    for i in pushed:
        for axis, share in zip(AXES, body.direction, strict=False):
            if share != 0.0:
                coef = weights[i] if share == 1.0 else _product(weights[i], share)
                ET.SubElement(fixed, "joint", joint=f"n{i}{axis}", coef=numbers(coef))


def _product(weight: float, share: float) -> float:
    """0 where it would be subnormal, which MuJoCo does not read."""
    product = weight * share
    return product if abs(product) >= np.finfo(float).tiny else 0.0


def _add_sensors(
    root: ET.Element, body: Body, timestep: float, delay: float, period: float
) -> None:
    """Sensors 0 .. L-1 feed the readout; if they are delayed or held, L more measure lengths.

    Delay and phase are half a physics step early: MuJoCo compares sums of steps, whose rounding
    would otherwise miss a sample now and then.
    """
    sensors = ET.SubElement(root, "sensor")
    timing: dict[str, str] = {}
    if delay > 0:
        timing["delay"] = numbers(delay - timestep / 2)
    if period > 0:
        timing["interval"] = numbers([period, -timestep / 2])
    if timing:
        samples = int(np.ceil(delay / (period or timestep) - 1e-9)) + 1
        timing["nsample"] = str(samples)
    sets = [("fed_length", timing), ("length", {})] if timing else [("length", {})]
    for prefix, options in sets:
        for j in range(body.n_springs):
            names = {"name": f"{prefix}{j}", "tendon": f"s{j}"}
            ET.SubElement(sensors, "tendonpos", names | options)
