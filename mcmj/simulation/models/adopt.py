"""Any MuJoCo model as a reservoir: its sensors are found by name, and the channels are added.

MjSpec keeps what the model is; what is added holds no force and changes no motion: actuators of
gain 0 (a channel each, see `mcmj.core.callbacks.reservoir_law`), sensors, one custom numeric.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, TypeAlias

import mujoco
import numpy as np
import numpy.typing as npt

from mcmj.core.callbacks.reservoir_law import NUMERIC, Law, block
from mcmj.core.integrators import INTEGRATORS, integrator_named
from mcmj.simulation.models.compiled import spec_of_compiled, take_numbers
from mcmj.simulation.models.names import (
    Channels,
    name_what_has_no_name,
    resolved_channels,
    resolved_sensors,
)
from mcmj.utils.errors import BodyFileError, InvalidArgumentError
from mcmj.utils.quiet import quiet_warnings
from mcmj.utils.validation import require_count, require_number

Model: TypeAlias = str | PathLike[str] | mujoco.MjSpec | mujoco.MjModel

OURS = "mcmj:"  # begins the names of what is added
CLOCK = f"{OURS}time"  # a sensor
_OWN = ("name", "id", "info", "signature", "compiler", "classname", "plugin")  # of an element
_COPIED = (
    "type",
    "objtype",
    "objname",
    "reftype",
    "refname",
    "intprm",
    "dim",
    "datatype",
    "cutoff",
)


@dataclass(frozen=True)
class AdoptedModel:
    """A compiled model with its channels.

    Attributes:
        spec, model: the model with what was added, to be written and to be stepped.
        asked: the arguments of `adopt` but the spec, all names in full, as JSON types.
        signals: (n_signals,) where they stand in sensordata, never delayed.
        late: (n_signals,) bool: MuJoCo computes it after actuation, so the law hears the value
            of the step before.
        signal_names, channel_names, input_names: of signals (component by component), outputs
            and inputs.
        first: actuator of the first channel; outputs, then inputs.
        memory: in userdata, where late signals are put back from.
        kept: (n,) in sensordata, what a batch must keep from chunk to chunk: the late signals as
            the law reads them (delayed, if there is a delay), then, if those are others, as they
            are recorded.
    """

    spec: mujoco.MjSpec
    model: mujoco.MjModel
    asked: dict[str, Any]
    signals: npt.NDArray[np.int64]
    late: npt.NDArray[np.bool_]
    signal_names: tuple[str, ...]
    channel_names: tuple[str, ...]
    input_names: tuple[str, ...]
    first: int
    memory: int
    kept: npt.NDArray[np.int64]


def read_spec(
    model: Model, timestep: float | None = None, integrator: str | None = None
) -> mujoco.MjSpec:
    """A copy of a model as MjSpec, with another step [s] or integrator if given.

    Raises:
        BodyFileError: no such file, or not a model.
        InvalidArgumentError, UnknownNameError: an argument out of bounds.
    """
    spec = _copied(model)
    if timestep is not None:
        require_number("timestep", timestep, 0.0, open_low=True)
        spec.option.timestep = timestep
    if integrator is not None:
        chosen = integrator_named(integrator)
        if chosen.by_callback:
            raise InvalidArgumentError("integrator", "one of MuJoCo's, for any model", integrator)
        name = chosen.mujoco_name
        spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{name.upper()}")
    return spec


def _copied(model: Model) -> mujoco.MjSpec:
    if isinstance(model, mujoco.MjSpec):
        return model.copy()
    if isinstance(model, mujoco.MjModel):
        return spec_of_compiled(model)
    if not isinstance(model, str | PathLike) or not str(model):
        raise InvalidArgumentError(
            "model", "MJCF (a path or a string), an MjSpec or an MjModel (dm_control's "
            "physics.model.ptr is one)", repr(model)
        )  # fmt: skip
    try:
        with quiet_warnings():
            if isinstance(model, str) and model.lstrip().startswith("<"):
                return mujoco.MjSpec.from_string(model)
            return mujoco.MjSpec.from_file(str(Path(model)))
    except (ValueError, OSError, TypeError) as error:
        raise BodyFileError(f"model: {' '.join(str(error).split())}") from error


def adopt(
    spec: mujoco.MjSpec,
    sensors: str | Sequence[str],
    channels: Channels,
    inputs: Channels = (),
    feedback_delay: int = 0,
    numbers: mujoco.MjModel | None = None,
) -> AdoptedModel:
    """A model with the channels of a reservoir; the arguments are those of Reservoir.

    Args:
        spec: of `read_spec`; it is changed.
        numbers: the compiled model that the spec was read from, if it was one.

    Raises:
        BodyFileError: not a model.
        InvalidArgumentError, UnknownNameError: an argument out of bounds, or a name or pattern
            that the model does not have.
    """
    require_count("feedback_delay", feedback_delay, 0)
    _check(spec)
    name_what_has_no_name(spec)
    _take_out_leapfrog(spec)
    heard = resolved_sensors(spec, sensors)
    outputs = resolved_channels(spec, "channel", channels)
    if not outputs:
        raise InvalidArgumentError("channels", "at least one actuator", channels)
    driven = resolved_channels(spec, "input", inputs)
    found = _with_channels(spec, heard, outputs, driven, feedback_delay)
    if numbers is not None:
        take_numbers(numbers, found.model)
        _take_out_leapfrog(found.model)
    return found


def _take_out_leapfrog(model: mujoco.MjSpec | mujoco.MjModel) -> None:
    """Let a body's file run under Euler, whatever callbacks are installed: others have no tag."""
    for row in INTEGRATORS.values():
        if not row.by_callback:
            continue
        if isinstance(model, mujoco.MjSpec):
            if (tag := model.numeric(row.name)) is not None:
                tag.data = np.zeros(1)
        elif mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, row.name) >= 0:
            model.numeric(row.name).data[:] = 0.0


def _check(spec: mujoco.MjSpec) -> None:
    """Raise unless the channels can be added."""
    elements = (*spec.sensors, *spec.actuators, *spec.numerics)
    ours = [element.name for element in elements if element.name.startswith((OURS, NUMERIC))]
    if ours:
        raise InvalidArgumentError(
            "model", f"one that is no reservoir yet: no name that begins with {OURS!r}", ours[0]
        )
    if spec.option.disableflags & mujoco.mjtDisableBit.mjDSBL_SENSOR.value:
        raise InvalidArgumentError("model", "sensors that are on", '<flag sensor="disable"/>')


def _with_channels(
    spec: mujoco.MjSpec,
    heard: list[str],
    outputs: dict[str, dict[str, float]],
    inputs: dict[str, dict[str, float]],
    feedback_delay: int,
) -> AdoptedModel:
    spec.add_sensor(name=CLOCK, type=mujoco.mjtSensor.mjSENS_CLOCK)
    law_reads = heard if feedback_delay == 0 else _delayed(spec, heard, feedback_delay)
    bare = _compiled(spec)
    signals, signal_names, late = _addresses(bare, heard)
    read = _addresses(bare, law_reads)[0]
    delay = max(0.0, feedback_delay - 0.5) * spec.option.timestep
    numbers = _law_block(bare, outputs, inputs, read, read[late], delay)
    spec.nuserdata = bare.nuserdata + (1 + int(late.sum()) if late.any() else 0)
    spec.nuser_actuator = max(bare.nuser_actuator, len(signals) + 1)
    for kind, name in [*(("output", n) for n in outputs), *(("input", n) for n in inputs)]:
        _add_channel(spec, f"{OURS}{kind}:{name}", len(signals) + 1)
    spec.add_numeric(name=NUMERIC, data=numbers, size=len(numbers))
    asked = {
        "sensors": heard,
        "channels": outputs,
        "inputs": inputs,
        "feedback_delay": feedback_delay,
    }
    return AdoptedModel(
        spec=spec,
        model=_compiled(spec),
        asked=asked,
        signals=signals,
        late=late,
        signal_names=signal_names,
        channel_names=tuple(outputs),
        input_names=tuple(inputs),
        first=bare.nu,
        memory=bare.nuserdata,
        kept=np.array([*read[late], *(signals[late] if feedback_delay else ())], np.int64),
    )


def _law_block(
    bare: mujoco.MjModel,
    outputs: dict[str, dict[str, float]],
    inputs: dict[str, dict[str, float]],
    read: npt.NDArray[np.int64],
    late: npt.NDArray[np.int64],
    delay: float,
) -> list[float]:
    """The law's numbers for a model without its channels, see reservoir_law.block."""
    drives = [
        (bare.actuator(name).id, channel, gain)
        for channel, gains in enumerate([*outputs.values(), *inputs.values()])
        for name, gain in gains.items()
    ]
    law = Law(
        outputs=len(outputs),
        first=bare.nu,
        clock=int(bare.sensor(CLOCK).adr[0]),
        signals=len(read),
        late=len(late),
        drives=len(drives),
        memory=bare.nuserdata,
    )
    return block(law, read.tolist(), late.tolist(), drives, delay)


def _add_channel(spec: mujoco.MjSpec, name: str, width: int) -> None:
    """An actuator without force, on what the first actuator moves; no default of the model's."""
    like, channel = spec.actuators[0], spec.add_actuator(name=name)
    plain = mujoco.MjSpec().add_actuator()
    for field in dir(plain):
        if not field.startswith(("_", "set_")) and field not in _OWN:
            setattr(channel, field, getattr(plain, field))
    for field in ("trntype", "target", "refsite", "slidersite", "cranklength"):
        setattr(channel, field, getattr(like, field))
    channel.gainprm, channel.userdata = np.zeros(len(plain.gainprm)), np.zeros(width)


def _delayed(spec: mujoco.MjSpec, heard: list[str], steps: int) -> list[str]:
    """Names of copies of sensors that show what was so many steps ago."""
    step, names = spec.option.timestep, []
    for name in heard:
        sensor = spec.sensor(name)
        if sensor.nsample or sensor.delay or np.any(sensor.interval):
            raise InvalidArgumentError(
                "feedback_delay", "0 with a sensor that has a delay or interval of its own", name
            )
        values: dict[str, Any] = {field: getattr(sensor, field) for field in _COPIED}
        names.append(f"{OURS}late:{name}")
        spec.add_sensor(name=names[-1], delay=(steps - 0.5) * step, nsample=steps + 1, **values)
    return names


def _addresses(
    model: mujoco.MjModel, names: list[str]
) -> tuple[npt.NDArray[np.int64], tuple[str, ...], npt.NDArray[np.bool_]]:
    """Places in sensordata of all components, their names, and whether they are late."""
    places: list[int] = []
    labels: list[str] = []
    late: list[bool] = []
    for name in names:
        sensor = model.sensor(name)
        first, width = int(sensor.adr[0]), int(sensor.dim[0])
        places += range(first, first + width)
        labels += [name] if width == 1 else [f"{name}[{i}]" for i in range(width)]
        late += [sensor.needstage[0] == mujoco.mjtStage.mjSTAGE_ACC] * width
    return np.array(places), tuple(labels), np.array(late)


def _compiled(spec: mujoco.MjSpec) -> mujoco.MjModel:
    try:
        with quiet_warnings():
            return spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise BodyFileError(f"model: {' '.join(str(error).split())}") from error
