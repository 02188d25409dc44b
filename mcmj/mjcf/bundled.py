"""Body files opened by a path, or by the name of a body that comes with mcmj."""

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcmj.core.body import Body
from mcmj.core.callbacks.spring_laws import NATIVE, SPRING_LAWS
from mcmj.core.integrators import DEFAULT_INTEGRATOR, TWINNED
from mcmj.mjcf.kept import provenance_of_model, readout_of_model, settings_of_model
from mcmj.mjcf.read import body_of_model, load_model, readouts_of_model
from mcmj.utils.errors import OtherPhysicsWarning, UnknownNameError
from mcmj.utils.validation import Array

# beside the package in the repository; inside it in an installed wheel
_FOLDERS = tuple(parent / "bodies" for parent in Path(__file__).parents[1:3])


def body_names() -> list[str]:
    """Names of the bodies that come with mcmj."""
    return sorted(path.stem for folder in _FOLDERS for path in folder.glob("*.xml"))


def body_path(name: str) -> Path:
    """Path of a body file: a file that exists, or the name of a body that comes with mcmj.

    Raises:
        UnknownNameError: neither.
    """
    if not name or Path(name).is_dir():
        raise UnknownNameError("body", name, [*body_names(), "a path to an .xml file"])
    given = Path(name)
    if given.suffix == ".xml" or given.exists():
        return given
    for folder in _FOLDERS:
        if (folder / f"{name}.xml").is_file():
            return folder / f"{name}.xml"
    raise UnknownNameError("body", name, [*body_names(), "a path to an .xml file"])


def model_names() -> list[str]:
    """Names of the MuJoCo models that come with mcmj, for `mcmj.Reservoir`; no planar bodies."""
    return sorted(path.stem for folder in _FOLDERS for path in folder.glob("models/*.xml"))


def model_path(name: str) -> Path:
    """Path of a model by its name.

    Raises:
        UnknownNameError: no such model.
    """
    for folder in _FOLDERS:
        if name and (folder / "models" / f"{name}.xml").is_file():
            return folder / "models" / f"{name}.xml"
    raise UnknownNameError("model", name, model_names())


@dataclass(frozen=True)
class StoredBody:
    """All that a body file holds, read at one time.

    Attributes:
        body: the body.
        w_out: the active readout (L or L + 1, n_outputs), None without one.
        readouts: readouts (L or L + 1, n_outputs) by name.
        provenance: where the body comes from; empty if the file does not say.
        settings: how the file says that it is stepped: arguments of a Simulation.
    """

    body: Body
    w_out: Array | None
    readouts: dict[str, Array]
    provenance: dict[str, Any]
    settings: dict[str, Any]

    def take(self, *names: str, **given: object) -> dict[str, Any]:
        """Arguments of a Simulation: those given, and the integrator and those named of the file.

        None is not given. The twin takes the file's integrator if it has it. Warns of what the
        file holds and the run does not take; a spring law of the file's that mcmj does not know
        is one.
        """
        names = ("integrator", *names)
        taken = {name: self.settings[name] for name in names if name in self.settings}
        if given.get("engine") == "twin" and taken.get("integrator") not in TWINNED:
            taken.pop("integrator", None)
        run = taken | {name: value for name, value in given.items() if value is not None}
        if run.get("springs", NATIVE) not in (NATIVE, *SPRING_LAWS):
            run["springs"] = NATIVE
        defaults = {"timestep": 1e-3, "integrator": DEFAULT_INTEGRATOR, "springs": NATIVE,
                    "feedback_delay": 0, "substeps": 1}  # fmt: skip
        whole = defaults | run
        other = [name for name, value in self.settings.items() if whole[name] != value]
        if other:
            said = ", ".join(f"{name} {self.settings[name]}" for name in other)
            takes = ", ".join(f"{name} {whole[name]}" for name in other)
            warnings.warn(
                f"the body file was written for {said}; this run takes {takes}",
                OtherPhysicsWarning,
                stacklevel=3,
            )
        return run


def open_body(name: str) -> StoredBody:
    """Read a body file, given by its path or by the name of a body that comes with mcmj.

    Raises:
        UnknownNameError: no such name.
        BodyFileError: no such file, or not an mcmj body.
    """
    model = load_model(body_path(name))
    return StoredBody(
        body=body_of_model(model),
        w_out=readout_of_model(model),
        readouts=readouts_of_model(model),
        provenance=provenance_of_model(model) or {},
        settings=settings_of_model(model),
    )
