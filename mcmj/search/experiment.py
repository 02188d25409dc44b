"""One trial of a search: an experiment under a config, and one number of its metrics.

Any module with a frozen dataclass `Config` and a function `run(config) -> result` with
`result.metrics` can be searched: those of mcmj.experiments by their short names, others by
their full ones ("my_package.my_experiment"). What it may have besides:

    Config.engine       "mujoco" or "twin": screened with the twin, confirmed in MuJoCo
    Config.seed         of the body, as `search` varies it
    SEARCH_DEFAULTS     dotted paths of Config -> values that leave out what a search needs not
    SEARCH_SCORE        what a search is after unless told otherwise, see Score.path
    result.body, result.readouts    the trained body, and its readouts by name, to write it
"""

import dataclasses
import functools
import hashlib
import importlib
import json
import math
import time
import warnings
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import ModuleType
from typing import Any

from mcmj.core.integrators import DEFAULT_INTEGRATOR
from mcmj.core.random_body import draw_body
from mcmj.metrics.metric_paths import matched, numbers_at, quantity
from mcmj.metrics.orbits import ORBIT_POINTS
from mcmj.mjcf.bundled import body_path
from mcmj.mjcf.write import to_mjcf
from mcmj.search.overrides import override
from mcmj.targets.named import NAMES, named_target
from mcmj.utils.errors import (
    DivergenceError,
    InvalidArgumentError,
    McmjError,
    McmjWarning,
    UnknownNameError,
)
from mcmj.utils.files import plain, versions
from mcmj.utils.threads import one_blas_thread

PACKAGE = "mcmj.experiments"
ORBIT_ERRORS = "*/orbit_error"
DONE, DIVERGED = "done", "diverged"


def load_experiment(name: str) -> ModuleType:
    """The module of an experiment.

    Raises:
        UnknownNameError: no such module.
        InvalidArgumentError: a module that is no experiment.
    """
    full = _full_name(name)
    if not all(part.isidentifier() for part in full.split(".")):
        raise UnknownNameError("experiment", name, _experiments())
    try:
        module = importlib.import_module(full)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{full}.".startswith(f"{error.name}."):
            raise  # it is there, but something that it needs is not
        raise UnknownNameError("experiment", name, _experiments()) from None
    if not dataclasses.is_dataclass(getattr(module, "Config", None)) or not hasattr(module, "run"):
        raise InvalidArgumentError("experiment", "a module with Config and run(config)", name)
    return module


def make_config(name: str, changes: Mapping[str, object]) -> Any:
    """The config of a trial: the experiment's own, its search defaults, then the changes."""
    module = load_experiment(name)
    return override(module.Config(), {**getattr(module, "SEARCH_DEFAULTS", {}), **changes})


def default_score(name: str) -> str:
    """The path of the score that an experiment asks for, or else its orbit errors."""
    return getattr(load_experiment(name), "SEARCH_SCORE", ORBIT_ERRORS)


@dataclasses.dataclass(frozen=True)
class Trial:
    """One run of an experiment that a search asks for."""

    experiment: str
    config: Any

    @property
    def seed(self) -> int | None:
        """The config's, if it has one."""
        return getattr(self.config, "seed", None)

    @functools.cached_property
    def key(self) -> str:
        """Of its place in a store: a hash of experiment, config, inputs, and the versions of
        mcmj and MuJoCo."""
        here = versions()
        account = [self.experiment, plain(self.config), self.inputs, here["mcmj"], here["mujoco"]]
        return hashlib.sha256(json.dumps(account, sort_keys=True).encode()).hexdigest()

    @functools.cached_property
    def inputs(self) -> str:
        """A hash of what the run reads besides: the code of an experiment of one's own (all of
        its package), the config's body file, files that it names as a Path, and its target."""
        digest = hashlib.sha256(_source_digest(self.experiment).encode())
        for name, value in vars(self.config).items():
            if isinstance(value, Path) or (name == "body" and isinstance(value, str)):
                with suppress(McmjError, OSError):  # what cannot be read, the run refuses
                    digest.update(name.encode() + body_path(str(value)).read_bytes())
            elif name == "task" and isinstance(value, str) and value not in NAMES:
                with suppress(McmjError):
                    digest.update(named_target(value).orbit(ORBIT_POINTS).tobytes())
        return digest.hexdigest()


@dataclasses.dataclass(frozen=True)
class Outcome:
    """What became of a trial.

    Attributes:
        status: done, or diverged: the simulation blew up.
        metrics: the experiment's, as JSON types; empty if it diverged.
        message: of the divergence.
        seconds: the run took.
        versions: of what it depends on, where it ran.
    """

    status: str
    metrics: dict[str, Any]
    message: str
    seconds: float
    versions: dict[str, str]


def evaluate(trial: Trial) -> Outcome:
    """Run a trial, with one BLAS thread; a simulation that blows up is an outcome.

    Raises:
        McmjError: an experiment that cannot run under this config; code or a body file that is
            not what the search began with.
    """
    if Trial(trial.experiment, trial.config).inputs != trial.inputs:
        raise McmjError(
            f"the code of {trial.experiment}, or the body file, is not what the search began with "
            "(edited meanwhile, or other files on this worker); run the same command again"
        )
    module = load_experiment(trial.experiment)
    status, message = DONE, ""
    metrics: Any = {}
    begin = time.perf_counter()
    with warnings.catch_warnings(), one_blas_thread():
        warnings.simplefilter("ignore", McmjWarning)  # a search meets bad bodies on purpose
        try:
            metrics = plain(module.run(trial.config).metrics)
        except DivergenceError as error:
            status, message = DIVERGED, str(error)
    seconds = time.perf_counter() - begin
    return Outcome(status, metrics, message, seconds, versions())


def trained_body(trial: Trial, account: Mapping[str, object]) -> str | None:
    """MJCF of a trial's body with its readouts and an account of where it comes from.

    Runs the trial again. Where the result has no body, the random body of the config's seed and
    settings; None if there is none either.

    Raises:
        McmjError: the trial cannot be run.
    """
    result, config = load_experiment(trial.experiment).run(trial.config), trial.config
    settings = getattr(config, "settings", None)
    body, readouts = getattr(result, "body", None), getattr(result, "readouts", {})
    if body is None and settings is not None and trial.seed is not None:
        body = draw_body(trial.seed, settings)
    if body is None:
        return None
    integrator = getattr(config, "integrator", None)
    integrator = getattr(result, "stepping", {}).get("integrator", integrator)
    provenance = {"experiment": trial.experiment, "config": plain(config), **account,
                  "versions": versions()}  # fmt: skip
    return to_mjcf(
        body,
        timestep=getattr(config, "timestep", 1e-3),
        integrator=integrator or DEFAULT_INTEGRATOR,
        w_out=next(iter(readouts.values()), None),
        readouts=readouts,
        provenance=provenance,
    )


@dataclasses.dataclass(frozen=True)
class Score:
    """The number that a search is after.

    Attributes:
        path: into the metrics, see metric_paths; where it has a "*", the worst number counts.
        threshold: a success is below it (above it, if maximised).
        maximise: large is good.
    """

    path: str
    threshold: float
    maximise: bool = False

    @property
    def name(self) -> str:
        """Of the number, for people."""
        return quantity(self.path)

    @property
    def worst(self) -> float:
        """Of a trial that blew up, or whose number is not finite."""
        return -math.inf if self.maximise else math.inf

    def parts(self, outcome: Outcome) -> dict[str, float]:
        """All numbers at the path, by full path; empty for a trial that diverged.

        Raises:
            UnknownNameError: the path leads to no number.
        """
        if outcome.status != DONE:
            return {}
        found = numbers_at(outcome.metrics, self.path)
        return {path: self.worst if x is None else x for path, x in found.items()}

    def label(self, part: str) -> str:
        """What sets a part apart from the others."""
        return matched(part, self.path)

    def of(self, outcome: Outcome) -> float:
        """The worst of the parts."""
        parts = self.parts(outcome).values()
        return (min if self.maximise else max)(parts, default=self.worst)

    def succeeds(self, score: float) -> bool:
        """Whether a score is on the good side of the threshold."""
        return score > self.threshold if self.maximise else score < self.threshold

    def order(self, score: float) -> float:
        """A sort key: the best comes first."""
        return -score if self.maximise else score


def check_versions(outcome: Outcome, where: str = "a worker") -> None:
    """Check that a trial ran on what this machine has too: else its bits may differ.

    Args:
        where: it ran or is kept, for the error.

    Raises:
        McmjError: another version of a package.
    """
    here = versions()
    other = {name: v for name, v in outcome.versions.items() if here.get(name) != v}
    if other:
        name, there = next(iter(other.items()))
        raise McmjError(
            f"{where} has {name} {there}, this machine {here.get(name)}: install the same "
            "versions everywhere, or results depend on where a trial runs"
        )


def _full_name(name: str) -> str:
    return name if "." in name else f"{PACKAGE}.{name}.run"


@functools.cache  # once a process, as Python loads code once
def _source_digest(name: str) -> str:
    """Of all source files of the package that an experiment of one's own belongs to."""
    package = _full_name(name).partition(".")[0]
    if package == "mcmj":  # its version stands for it
        return ""
    digest = hashlib.sha256()
    for folder in map(Path, importlib.import_module(package).__path__):
        for path in sorted(folder.rglob("*.py")):
            digest.update(str(path.relative_to(folder)).encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def _experiments() -> list[str]:
    """Names of the experiments of mcmj that can be searched."""
    (folder,) = map(Path, importlib.import_module(PACKAGE).__path__)
    return sorted(path.parent.name for path in folder.glob("*/run.py"))
