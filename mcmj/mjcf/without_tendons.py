"""Body -> a compiled model without spatial tendons: what a Simulation steps by default.

MuJoCo's spatial tendons are half of a step of a body. Here mcmj's callbacks compute the springs,
from a table in the model (core.callbacks.spring_table): the passive forces and the lengths, which
are a user sensor. Bodies, joints and actuators are those of the body's file (mjcf.write), under the
same names; sites and looks are left out. The model runs only under the callbacks, and only in the
process that made it if the springs have a law.
"""

from typing import NamedTuple

import mujoco
import numpy as np

from mcmj.core.body import Body
from mcmj.core.callbacks.coupled_laws import CoupledLaw
from mcmj.core.callbacks.leapfrog import userdata_size
from mcmj.core.callbacks.pointers import TAG
from mcmj.core.callbacks.spring_laws import SpringLaw, spring_law
from mcmj.core.callbacks.spring_table import TABLE_TAG, memory_size
from mcmj.core.integrators import integrator_named
from mcmj.core.options import Options
from mcmj.mjcf.write import JOINTS
from mcmj.utils.errors import BodyFileError
from mcmj.utils.quiet import quiet_warnings
from mcmj.utils.validation import Array

TABLE = "springs"  # name of the numeric
# stages that have nothing to do, or what mcmj's callbacks do instead
_IDLE = (
    "CONSTRAINT", "CONTACT", "GRAVITY", "DAMPER", "EULERDAMP", "ACTUATION", "WARMSTART", "ISLAND",
    "AUTORESET",
)  # fmt: skip


class Memory(NamedTuple):
    """Of the lengths that the readout hears: slots (0: none), physics steps between them."""

    slots: int
    period: int


def memory_of(options: Options) -> Memory:
    """One slot holds lengths over substeps; one more for each step of delay."""
    wanted = options.feedback_delay > 0 or options.substeps > 1
    return Memory(options.feedback_delay + 1 if wanted else 0, options.substeps)


def model_without_tendons(body: Body, options: Options) -> mujoco.MjModel:
    """Compile it, the loop open, with room for a readout with bias.

    Raises:
        BodyFileError: MuJoCo cannot compile it.
    """
    scheme, memory = integrator_named(options.integrator), memory_of(options)
    spec = mujoco.MjSpec()
    spec.modelname = "mcmj body without tendons"
    spec.option.timestep = options.physics_step
    spec.option.gravity = np.zeros(3)
    spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{scheme.mujoco_name.upper()}")
    for name in _IDLE:
        spec.option.disableflags |= getattr(mujoco.mjtDisableBit, f"mjDSBL_{name}").value
    if scheme.by_callback:
        spec.add_numeric(name=scheme.name, data=[TAG])
        spec.nuserdata = userdata_size(body.dimensions * len(body.free))
    spec.nuserdata += memory_size(body.n_springs, memory.slots)
    spec.add_numeric(name=TABLE, data=spring_table(body, spring_law(options.springs), memory))
    _add_nodes(spec, body)
    _add_channels(spec, body, delayed=options.feedback_delay > 0)
    for name in ("fed_lengths", "lengths") if memory.slots else ("lengths",):
        spec.add_sensor(
            name=name,
            type=mujoco.mjtSensor.mjSENS_USER,
            needstage=mujoco.mjtStage.mjSTAGE_POS,
            datatype=mujoco.mjtDataType.mjDATATYPE_REAL,
            dim=body.n_springs,
        )
    try:
        with quiet_warnings():
            return spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        reason = " ".join(str(error).split())
        raise BodyFileError(f"{body!r}: MuJoCo cannot compile it: {reason}") from error


def spring_table(body: Body, law: SpringLaw | None, memory: Memory) -> Array:
    """The block of a body's springs and channels, see core.callbacks.spring_table."""
    first = np.full(body.n_nodes, -1.0)
    first[body.free] = body.dimensions * np.arange(len(body.free))
    places = np.zeros((3, body.n_nodes))
    places[: body.dimensions] = body.positions.T
    channels = [*body.w_in.T, *body.w_fb.T]
    shares = np.zeros((len(channels), body.dimensions * len(body.free)))
    for share, weights in zip(shares, channels, strict=True):
        share[:] = np.outer(weights[body.free], body.direction).ravel()
    key = 0.0 if law is None else law.key(body.n_springs)
    sizes = [TABLE_TAG, body.dimensions, body.n_nodes, body.n_springs, len(channels)]
    springs = [*body.springs.T, body.rest_lengths, body.k1, body.k3, body.d1, body.d3]
    uncut = np.ones(body.n_springs)
    parts = [sizes, [key, isinstance(law, CoupledLaw), *memory], first, places, shares, *springs]
    return np.concatenate([np.ravel(np.asarray(part, float)) for part in (*parts, uncut)])


def cut_springs(numeric: Array, body: Body, cut: list[int]) -> None:
    """Springs without force, in the numbers (.., n) of models of a body."""
    numeric[..., -body.n_springs :][..., cut] = 0.0


def _add_nodes(spec: mujoco.MjSpec, body: Body) -> None:
    for i in body.free:
        place = np.zeros(3)
        place[: body.dimensions] = body.positions[i]
        node = spec.worldbody.add_body(
            name=f"n{i}", pos=place, mass=body.masses[i], explicitinertial=True,
            ipos=np.zeros(3), iquat=[1.0, 0.0, 0.0, 0.0], inertia=np.ones(3),
        )  # fmt: skip
        for name, axis in JOINTS[: body.dimensions]:
            node.add_joint(
                name=f"n{i}{name}",
                type=mujoco.mjtJoint.mjJNT_SLIDE,
                axis=np.array(axis.split(), float),
            )


def _add_channels(spec: mujoco.MjSpec, body: Body, *, delayed: bool) -> None:
    """Actuators as in the body's file, for ctrl, gates and readouts; the table says their forces.

    They stand on the first joint, and MuJoCo's actuation is disabled.
    """
    names = [f"in{c}" for c in range(body.n_inputs)] + [f"fb{c}" for c in range(body.n_outputs)]
    for name in names:
        channel = spec.add_actuator(
            name=name, target=f"n{body.free[0]}x", trntype=mujoco.mjtTrn.mjTRN_JOINT
        )
        channel.userdata = np.zeros(body.n_springs + 1)
        if name.startswith("fb"):
            channel.biasprm[:5] = 0.0, TAG, 0.0, body.n_springs, delayed
