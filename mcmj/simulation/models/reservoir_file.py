"""A trained reservoir as one file: its model, with sensors, channels and readout inside.

What `adopt` added is in the file, so that MuJoCo's own viewer shows it; a custom text says what
was asked for, and holds the readout exactly. MuJoCo's writer keeps six digits of the rest.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from mcmj.core.callbacks.reservoir_law import NUMERIC
from mcmj.core.readout import Readout
from mcmj.simulation.models.adopt import OURS, AdoptedModel, Model, read_spec
from mcmj.simulation.models.damage import write_damage
from mcmj.utils.errors import BodyFileError
from mcmj.utils.quiet import quiet_warnings
from mcmj.utils.validation import Array

SETTINGS = "mcmj_reservoir_settings"  # the custom text


def write_reservoir(
    adopted: AdoptedModel,
    readout: Readout | None,
    alterations: Sequence[tuple[Sequence[str], Mapping[str, float] | None]] = (),
) -> str:
    """MJCF of a model with its channels and, if there is one, its readout, its loop closed.

    Args:
        alterations: tendons cut and masses [kg] of bodies, see mcmj.simulation.damage.
    """
    spec = adopted.spec.copy()
    if adopted.spec.modelfiledir:  # meshes and textures are found from any folder
        folder = Path(adopted.spec.modelfiledir).absolute()
        spec.meshdir, spec.texturedir = str(folder / spec.meshdir), str(folder / spec.texturedir)
    for cut, masses in alterations:
        write_damage(spec, adopted.model, cut, masses or {})
    kept = None if readout is None else readout.rows.tolist()
    spec.add_text(name=SETTINGS, data=json.dumps({**adopted.asked, "w_out": kept}))
    for c, name in enumerate(adopted.channel_names if readout else ()):
        actuator = spec.actuator(f"{OURS}output:{name}")
        actuator.userdata = readout.rows[:, c] if readout else ()
        gate = actuator.biasprm
        gate[0] = 1.0
    with quiet_warnings():
        spec.compile()
        return str(spec.to_xml())


def is_reservoir_file(path: str | Path) -> bool:
    """Whether a file is one of `write_reservoir`."""
    file = Path(path)
    return file.is_file() and SETTINGS in file.read_text(errors="replace")


def read_reservoir(model: Model) -> tuple[mujoco.MjSpec, dict[str, Any], Array | None]:
    """What a file of `write_reservoir` holds.

    Returns:
        the model as it was before it was adopted, the other arguments of `adopt`, and the
        readout (n_signals + 1, n_channels), or None.

    Raises:
        BodyFileError: no such file, not a model, or not that of a reservoir.
    """
    spec = read_spec(model)
    texts = {text.name: text for text in spec.texts}
    numbers = {numeric.name: numeric for numeric in spec.numerics}
    try:
        asked = json.loads(texts[SETTINGS].data)
        kept = asked.pop("w_out")
        w_out = None if kept is None else np.array(kept, np.float64)
        if set(asked) != {"sensors", "channels", "inputs", "feedback_delay"}:
            raise ValueError("its settings do not fit")
        added = [texts[SETTINGS], numbers[NUMERIC]]
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        raise BodyFileError(
            f"model: not the file of a reservoir ({error}): mcmj.Reservoir(model, sensors=.., "
            "channels=..) makes one of any model, and its to_mjcf() the file"
        ) from error
    added += [one for one in (*spec.actuators, *spec.sensors) if one.name.startswith(OURS)]
    for element in added:
        spec.delete(element)
    for key in spec.keys:
        if len(key.ctrl):
            key.ctrl = list(key.ctrl)[: len(spec.actuators)]
    return spec, asked, w_out
