"""Run trials on workers, each once, and keep every outcome as soon as it is there."""

import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from dataclasses import dataclass, field

from mcmj.search.claims import LEASE
from mcmj.search.database import TrialStore
from mcmj.search.experiment import Outcome, Trial, check_versions, evaluate
from mcmj.search.workers import Workers
from mcmj.utils.errors import McmjError

OnOutcome = Callable[[Trial, Outcome], object]

AHEAD = 2  # trials in flight per worker: none waits for the store
DEATHS = 5  # workers killed one after the other, without a trial finished, before giving up
_POLL = 0.5  # s between looks at what other searches have finished
_RENEW = LEASE / 6


@dataclass
class SearchRun:
    """What became of all trials.

    Attributes:
        outcomes: by key.
        evaluated: number of trials that were run here and now.
        seconds: from the first to the last of them, by the clock.
    """

    outcomes: dict[str, Outcome] = field(default_factory=dict)
    evaluated: int = 0
    seconds: float = 0.0


def run_trials(
    trials: Sequence[Trial],
    store: TrialStore,
    workers: Workers,
    *,
    on_outcome: OnOutcome = lambda trial, outcome: None,
) -> SearchRun:
    """Outcomes of all trials: from the store, from workers, or from another search at work.

    Args:
        on_outcome: called with every trial and its outcome as soon as there is one.

    Raises:
        McmjError: a trial that cannot run, workers that die all the time, a full disk. What is
            finished is kept, and the same call goes on from there.
    """
    return _Runner(trials, store, workers, on_outcome).run()


class _Runner:
    def __init__(
        self, trials: Sequence[Trial], store: TrialStore, workers: Workers, on_outcome: OnOutcome
    ) -> None:
        self._trials = {trial.key: trial for trial in trials}
        self._store, self._workers, self._on_outcome = store, workers, on_outcome
        self._waiting = deque(self._trials)  # keys nobody has looked at yet
        self._elsewhere: set[str] = set()  # keys that another search has claimed
        self._flying: dict[Future[Outcome], str] = {}
        self._deaths = 0
        self._renewed = self._polled = time.monotonic()
        self._result = SearchRun()

    def run(self) -> SearchRun:
        self._take_finished(list(self._waiting))
        begin = time.perf_counter()
        try:
            while self._waiting or self._flying or self._elsewhere:
                self._send()
                self._collect()
                self._look_elsewhere()
        finally:
            for future in self._flying:
                future.cancel()
        self._result.seconds = time.perf_counter() - begin
        return self._result

    def _send(self) -> None:
        """Keep the workers busy with trials that are ours."""
        free = AHEAD * self._workers.count - len(self._flying)
        while free > 0 and self._waiting:
            keys = [self._waiting.popleft() for _ in range(min(free, len(self._waiting)))]
            mine = self._store.claim(keys)
            for key in keys:
                if key in mine:
                    future = self._workers.submit(evaluate, self._trials[key])
                    self._flying[future] = key
                else:
                    self._elsewhere.add(key)
            free -= len(mine)

    def _collect(self) -> None:
        if not self._flying:
            return
        done, _ = wait(self._flying, timeout=_POLL, return_when=FIRST_COMPLETED)
        failed: BaseException | None = None
        for future in done:
            key = self._flying.pop(future)
            error = _error(future)
            if error is None:
                self._finish(key, future.result())
            elif self._workers.lost(error):
                self._again(key)
            else:
                failed = error
        if failed is not None:  # after what is finished has been kept
            raise failed
        if time.monotonic() - self._renewed > _RENEW:
            self._store.renew()
            self._renewed = time.monotonic()

    def _finish(self, key: str, outcome: Outcome) -> None:
        check_versions(outcome)
        self._store.add(self._trials[key], outcome)
        self._result.evaluated += 1
        self._deaths = 0
        self._tell(key, outcome)

    def _again(self, key: str) -> None:
        self._deaths += 1
        if self._deaths > DEATHS * AHEAD * self._workers.count:
            raise McmjError(
                "workers are killed again and again (out of memory?); finished trials are kept"
            )
        self._waiting.appendleft(key)

    def _look_elsewhere(self) -> None:
        """Take what other searches finished; run ourselves what they gave up."""
        if not self._elsewhere or time.monotonic() - self._polled < _POLL:
            if self._elsewhere and not self._flying and not self._waiting:
                time.sleep(_POLL / 5)
            return
        self._polled = time.monotonic()
        self._take_finished(list(self._elsewhere))
        if not self._waiting:
            self._waiting.extend(self._elsewhere)  # claimed if their owner is gone
            self._elsewhere.clear()

    def _take_finished(self, keys: list[str]) -> None:
        for key, outcome in self._store.outcomes(keys).items():
            check_versions(outcome, f"{self._store.path}: a trial kept there")
            self._tell(key, outcome)
        found = self._result.outcomes
        self._waiting = deque(key for key in self._waiting if key not in found)
        self._elsewhere -= found.keys()

    def _tell(self, key: str, outcome: Outcome) -> None:
        self._result.outcomes[key] = outcome
        self._on_outcome(self._trials[key], outcome)


def _error(future: Future[Outcome]) -> BaseException | None:
    try:
        return future.exception()
    except CancelledError:
        return McmjError("the workers are gone; finished trials are kept: run again to go on")
