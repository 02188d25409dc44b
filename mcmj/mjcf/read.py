"""MJCF -> Body: what `mcmj.mjcf.write` wrote, to the bit, from a file or a compiled model."""

import re
from pathlib import Path

import mujoco
import numpy as np

from mcmj.core.body import Body
from mcmj.core.callbacks.pointers import TAG
from mcmj.mjcf.check import require_same_physics
from mcmj.mjcf.kept import by_callback, ids, readout_of_model, stored_numbers, text_names, timing
from mcmj.mjcf.scan import MAX_BYTES, read_body_file, scan
from mcmj.mjcf.write import READOUT_PREFIX, to_mjcf
from mcmj.utils.errors import BodyFileError, InvalidArgumentError
from mcmj.utils.quiet import quiet_warnings
from mcmj.utils.validation import Array

LARGEST = 1e60  # of any number of a body
_JOINT = re.compile(r"n([0-9]{1,9})x")


def from_mjcf(xml_or_path: str | Path) -> tuple[Body, Array | None]:
    """Read back a body, and its readout if it has one, from MJCF text or a file.

    Raises:
        BodyFileError: no such file, not MJCF, or not an mcmj body.
    """
    model = load_model(xml_or_path)
    return body_of_model(model), readout_of_model(model)


def load_model(xml_or_path: str | Path, max_bytes: int = MAX_BYTES) -> mujoco.MjModel:
    """Compile MJCF text (anything that starts with "<") or a file.

    The text is scanned first: it may not read other files, repeat elements, or be or allocate
    more than `max_bytes`.

    Raises:
        BodyFileError: no such file, refused by the scan, or MuJoCo cannot compile it.
    """
    text = str(xml_or_path)
    inline = text.lstrip().startswith("<")
    source = "MJCF text" if inline else text[:200]
    if not inline:
        text = read_body_file(text, max_bytes)
    scan(text, source, max_bytes)
    model = _compiled(text, source)
    _require_readouts_inside(model, source)
    return model


def _compiled(text: str, source: str) -> mujoco.MjModel:
    try:
        with quiet_warnings():
            return mujoco.MjSpec.from_string(text).compile()  # see core.callbacks.offsets
    except (ValueError, mujoco.FatalError) as error:
        reason = " ".join(str(error).split())
        raise BodyFileError(f"{source}: MuJoCo cannot compile it: {reason}") from error


def _require_readouts_inside(model: mujoco.MjModel, source: str) -> None:
    """Every readout reads sensors that exist; the callback ignores one that does not."""
    gates, tags = model.actuator_biasprm[:, :2].T
    for actuator in np.flatnonzero((tags == TAG) & (gates != 0)):
        first, count = model.actuator_biasprm[actuator, 2:4]
        room = min(model.nuser_actuator, model.nsensordata - first)
        if not (first >= 0 and 1 <= count <= room):
            raise BodyFileError(
                f"{source}: actuator {model.actuator(actuator).name!r}: its readout reads "
                f"{count:g} numbers from sensor {first:g} on with {model.nuser_actuator} weights, "
                f"of {model.nsensordata} that exist"
            )


def body_of_model(model: mujoco.MjModel) -> Body:
    """The Body inside a compiled model.

    Raises:
        BodyFileError: the model is not an mcmj body, or holds physics that a Body cannot say.
    """
    nodes = ids(model, mujoco.mjtObj.mjOBJ_SITE, "n", model.nsite)
    springs = ids(model, mujoco.mjtObj.mjOBJ_TENDON, "s", model.ntendon)
    if len(nodes) < 2 or len(springs) == 0:
        raise BodyFileError(
            "not an mcmj body: expected sites n0, n1, .. and spatial tendons s0, s1, .., got "
            f"{len(nodes)} such sites and {len(springs)} such tendons; any other model can be a "
            "Reservoir, whose to_mjcf() is for `mcmj view` and `mcmj capacity --reservoir`"
        )
    owner = model.site_bodyid[nodes]
    fixed = owner == 0
    positions = model.body_pos[owner] + model.site_pos[nodes]
    masses = np.where(fixed, 1.0, model.body_mass[owner])
    if (stored := stored_numbers(model, "fixed_masses")) is not None:
        masses[fixed] = _shaped(stored, (int(fixed.sum()),), "fixed_masses")
    try:
        body = Body(
            positions=positions[:, : _dimensions(model, fixed)],
            springs=_spring_ends(model, springs, nodes),
            fixed=fixed,
            masses=masses,
            w_in=_weights(model, "in", fixed),
            w_fb=_weights(model, "fb", fixed),
            direction=stored_numbers(model, "direction"),  # type: ignore[arg-type]  # None: x
            **_spring_parameters(model, springs),
        )
    except InvalidArgumentError as error:
        raise BodyFileError(f"not a valid mcmj body: {error}") from error
    _require_moderate(body)
    require_same_physics(model, _compiled(_written_again(model, body), "the body written again"))
    return body


def _written_again(model: mujoco.MjModel, body: Body) -> str:
    """The body as a file with the model's step, delays and kind of springs."""
    step, delay, period = timing(model)
    closed = readout_of_model(model) is not None
    try:
        return to_mjcf(
            body,
            timestep=step,
            w_out=np.zeros((body.n_springs, body.n_outputs)) if closed else None,
            springs="cubic" if by_callback(model) else "native",
            feedback_delay=delay,
            control_period=period,
        )
    except InvalidArgumentError as error:
        raise BodyFileError(f"not a valid mcmj body: {error}") from error


def _require_moderate(body: Body) -> None:
    """Quotients such as k / m of what is read stay finite."""
    for name in ("positions", "rest_lengths", "masses", "k1", "k3", "d1", "d3", "w_in", "w_fb"):
        size = np.abs(getattr(body, name)).max(initial=0.0)
        if size > LARGEST:
            raise BodyFileError(f"{name}: expected at most {LARGEST:g} in size, got {size:g}")
    if (least := body.masses.min()) < 1 / LARGEST:
        raise BodyFileError(f"masses: expected at least {1 / LARGEST:g}, got {least:g}")


def readouts_of_model(model: mujoco.MjModel) -> dict[str, Array]:
    """The named readouts that `to_mjcf` stored, (L or L + 1, n_outputs) each.

    Raises:
        BodyFileError: the model is not an mcmj body, or a readout does not fit it.
    """
    names = [name for name in text_names(model) if name.startswith(READOUT_PREFIX)]
    if not names:
        return {}
    body = body_of_model(model)
    readouts = {}
    for name in names:
        values = stored_numbers(model, name)
        assert values is not None
        if values.size not in (body.n_outputs * (body.n_springs + k) for k in (0, 1)):
            raise BodyFileError(f"{name}: {values.size} weights do not fit {body!r}")
        readouts[name.removeprefix(READOUT_PREFIX)] = values.reshape(-1, body.n_outputs)
    return readouts


def _spring_ends(model: mujoco.MjModel, springs: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    node_of_site = {site: node for node, site in enumerate(nodes.tolist())}
    ends = []
    for tendon in springs:
        start = model.tendon_adr[tendon]
        sites = model.wrap_objid[start : start + model.tendon_num[tendon]].tolist()
        if len(sites) != 2 or not all(site in node_of_site for site in sites):
            raise BodyFileError(f"tendon {model.tendon(tendon).name} does not join two nodes")
        ends.append([node_of_site[site] for site in sites])
    return np.array(ends)


def _spring_parameters(model: mujoco.MjModel, springs: np.ndarray) -> dict[str, Array]:
    if by_callback(model):
        columns = model.tendon_user[springs, 2:7].T
        return dict(zip(("rest_lengths", "k1", "k3", "d1", "d3"), columns, strict=True))
    if model.tendon_stiffnesspoly[springs, 0].any() or model.tendon_dampingpoly[springs, 0].any():
        raise BodyFileError("a spring with a quadratic term is not an mcmj spring")
    return {
        "rest_lengths": model.tendon_lengthspring[springs, 0],
        "k1": model.tendon_stiffness[springs],
        "k3": model.tendon_stiffnesspoly[springs, 1],
        "d1": model.tendon_damping[springs],
        "d3": model.tendon_dampingpoly[springs, 1],
    }


def _dimensions(model: mujoco.MjModel, fixed: np.ndarray) -> int:
    """3 if the free nodes have joints along z."""
    free = np.flatnonzero(~fixed)
    name = f"n{free[0]}z" if free.size else "none"
    return 3 if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name) >= 0 else 2


def _weights(model: mujoco.MjModel, prefix: str, fixed: np.ndarray) -> Array:
    """Weights (N, channels) from the joint coefficients of the channels' fixed tendons.

    Of a body pushed along another direction than x, coefficients are products: its weights are
    stored beside them, and what is compiled of them must be the model (`require_same_physics`).
    """
    channels = ids(model, mujoco.mjtObj.mjOBJ_TENDON, prefix, model.ntendon)
    driven = ids(model, mujoco.mjtObj.mjOBJ_ACTUATOR, prefix, model.nu)
    if len(driven) != len(channels):
        raise BodyFileError(
            f"{len(channels)} tendons {prefix}0, {prefix}1, .. but {len(driven)} such actuators"
        )
    whole = stored_numbers(model, f"w_{prefix}")
    if whole is not None:
        return _shaped(whole, (len(fixed), len(channels)), f"w_{prefix}")
    weights = np.zeros((len(fixed), len(channels)))
    for c, tendon in enumerate(channels):
        for wrap in range(
            model.tendon_adr[tendon], model.tendon_adr[tendon] + model.tendon_num[tendon]
        ):
            joint = _JOINT.fullmatch(model.joint(model.wrap_objid[wrap]).name)
            if model.wrap_type[wrap] != mujoco.mjtWrap.mjWRAP_JOINT or joint is None:
                raise BodyFileError(f"tendon {prefix}{c} does not push nodes along x")
            if int(joint[1]) >= len(fixed):
                raise BodyFileError(f"tendon {prefix}{c} pushes a node that is not there")
            weights[int(joint[1]), c] = model.wrap_prm[wrap]
    stored = stored_numbers(model, f"fixed_w_{prefix}")
    if stored is not None:
        weights[fixed] = _shaped(stored, (int(fixed.sum()), len(channels)), prefix)
    return weights


def _shaped(values: Array, shape: tuple[int, ...], name: str) -> Array:
    if values.size != np.prod(shape):
        raise BodyFileError(f"{name}: expected {np.prod(shape)} numbers, got {values.size}")
    return values.reshape(shape)
