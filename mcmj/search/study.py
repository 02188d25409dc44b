"""Guided search over settings: Optuna proposes, the same trials as everywhere answer.

A study lives in a SQLite file of its own. The proposal number n depends on the seed and on what
was told before, so that a study that was interrupted goes on as if it had not been.
"""

import hashlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from mcmj.search.space import Choices, Range, Space
from mcmj.utils.errors import InvalidArgumentError, OutputError
from mcmj.utils.extras import extra

Evaluate = Callable[[dict[str, object]], float]  # a setting -> its objective


class Study:
    """Settings tried so far, and the next to try (tree-structured Parzen estimator).

    Args:
        path: of the SQLite file; made if there is none. It can hold many studies.
        account: all that the objective depends on; a study of anything else is another one.
        space: what is varied.
        seed: of the proposals.
        startup: number of random settings that come first.
        maximise: large objectives are good.

    Raises:
        MissingExtraError: Optuna is not installed.
        OutputError: the file cannot be used.
        InvalidArgumentError: nothing is varied.
    """

    def __init__(
        self, path: str | Path, account: object, space: Space, seed: int, *, startup: int,
        maximise: bool,
    ) -> None:  # fmt: skip
        with extra("search", "a guided search needs Optuna"):
            import optuna
            from sqlalchemy.exc import SQLAlchemyError
        if not space:
            raise InvalidArgumentError("vary", "at least one field to choose", "none")
        self._optuna, self._space = optuna, dict(space)
        self._seed, self._startup = seed, startup
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        name = hashlib.sha256(json.dumps(account, sort_keys=True).encode()).hexdigest()[:16]
        try:
            self._study = optuna.create_study(
                storage=f"sqlite:///{path}",
                study_name=name,
                load_if_exists=True,
                direction="maximize" if maximise else "minimize",
            )
        except SQLAlchemyError as error:
            raise OutputError(f"{path}: no study can be kept there ({error.__cause__})") from error

    @property
    def told(self) -> list[tuple[dict[str, object], float]]:
        """Settings and objectives so far, in order."""
        return [
            (self._setting(trial.params), float(trial.values[0]))
            for trial in self._study.get_trials(deepcopy=False)
            if trial.state == self._optuna.trial.TrialState.COMPLETE
        ]

    @property
    def best(self) -> tuple[dict[str, object], float]:
        """The best setting and its objective."""
        trial = self._study.best_trial
        return self._setting(trial.params), float(trial.values[0])

    def first(self, setting: Mapping[str, object]) -> None:
        """Have a new study try a setting first, if it lies in the space."""
        inside = all(_contains(part, setting[path]) for path, part in self._space.items())
        if inside and not self._study.get_trials(deepcopy=False):
            self._study.enqueue_trial({p: _encode(self._space[p], setting[p]) for p in self._space})

    def advance(self, evaluate: Evaluate) -> float:
        """Evaluate one more setting; what an interruption left half-done comes first."""
        running = (self._optuna.trial.TrialState.RUNNING,)
        left = self._study.get_trials(deepcopy=False, states=running)
        if left:
            number, params = left[0].number, left[0].params
            missing = self._space.keys() - params.keys()
            if missing:  # killed while it was proposed
                self._study.tell(number, state=self._optuna.trial.TrialState.FAIL)
                return self.advance(evaluate)
        else:
            number, params = self._ask()
        objective = evaluate(self._setting(params))
        self._study.tell(number, objective)
        return objective

    def _ask(self) -> tuple[int, dict[str, Any]]:
        total = len(self._study.get_trials(deepcopy=False))
        self._study.sampler = self._optuna.samplers.TPESampler(
            n_startup_trials=self._startup, seed=self._seed + total
        )
        trial = self._study.ask()
        for path, part in self._space.items():
            if isinstance(part, Choices):
                trial.suggest_categorical(path, [json.dumps(value) for value in part.values])
            elif part.kind == "int":
                trial.suggest_int(path, int(part.low), int(part.high))
            else:
                trial.suggest_float(path, part.low, part.high, log=part.kind == "log")
        return trial.number, trial.params

    def _setting(self, params: Mapping[str, Any]) -> dict[str, object]:
        return {
            path: json.loads(params[path]) if isinstance(part, Choices) else params[path]
            for path, part in self._space.items()
        }


def _contains(part: Choices | Range, value: object) -> bool:
    if isinstance(part, Choices):
        return json.dumps(value) in [json.dumps(choice) for choice in part.values]
    return isinstance(value, int | float) and part.low <= value <= part.high


def _encode(part: Choices | Range, value: object) -> object:
    return json.dumps(value) if isinstance(part, Choices) else value
