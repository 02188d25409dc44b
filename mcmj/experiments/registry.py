"""The experiments by name: each folder of mcmj.experiments that has a command."""

import importlib
import pkgutil
from dataclasses import dataclass

import mcmj.experiments
from mcmj.experiments.base import Experiment
from mcmj.utils.errors import UnknownNameError

GROUPS = ("the paper", "analysis", "robots", "search", "speed and accuracy", "pictures")


@dataclass(frozen=True)
class Entry:
    """What `mcmj --help` says of an experiment: its group and one line."""

    group: str
    line: str


def entries() -> dict[str, Entry]:
    """What every experiment is for, from its folder's docstring; none is loaded."""
    found = {}
    for module in pkgutil.iter_modules(mcmj.experiments.__path__):
        if module.ispkg:
            package = importlib.import_module(f"mcmj.experiments.{module.name}")
            line = (package.__doc__ or "").partition("\n")[0]
            found[module.name] = Entry(package.GROUP, line)
    return found


def experiment_named(name: str) -> Experiment:
    """An experiment of mcmj, or of one's own: a dotted module name with EXPERIMENT in it.

    Raises:
        UnknownNameError: no such experiment.
    """
    own = "." in name and all(part.isidentifier() for part in name.split("."))
    full = name if own else f"mcmj.experiments.{name}.command"
    if not own and name not in entries():
        raise UnknownNameError("experiment", name, entries())
    try:
        module = importlib.import_module(full)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{full}.".startswith(f"{error.name}."):
            raise  # it is there, but something that it needs is not
        raise UnknownNameError("experiment", name, entries()) from None
    found = getattr(module, "EXPERIMENT", None)
    if not isinstance(found, Experiment):
        raise UnknownNameError("experiment", name, entries())
    return found
