"""A store of trials: one SQLite file, safe against kills, and against two searches at once.

A trial is written in one transaction when it ends (write-ahead log, so a process killed at any
moment loses at most trials that still run). Before a trial runs it is claimed for a while, and
the claim is renewed as long as the search lives: another search on the same store then waits
for the result instead of running the trial again, and takes over what a dead one left.
"""

import json
import sqlite3
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from mcmj.search.claims import LEASE, is_held, own_name
from mcmj.search.experiment import DIVERGED, DONE, Outcome, Trial
from mcmj.utils.errors import InvalidArgumentError, OutputError, StoreError
from mcmj.utils.files import plain

APPLICATION = 0x6D636D6A  # "mcmj", in the file's header
SCHEMA = 2  # 2: keys know the experiment's code, the body file and MuJoCo's version
_PATIENCE = 60.0  # s to wait for another process's write
_RETRY = 0.01  # s between tries where SQLite does not wait
_BATCH = 500  # keys in one query

_TABLES = """
CREATE TABLE trials (
    key TEXT PRIMARY KEY, experiment TEXT NOT NULL, seed INTEGER, config TEXT NOT NULL,
    versions TEXT NOT NULL, status TEXT NOT NULL, metrics TEXT NOT NULL, message TEXT NOT NULL,
    seconds REAL NOT NULL, finished TEXT NOT NULL
) WITHOUT ROWID;
CREATE TABLE claims (key TEXT PRIMARY KEY, owner TEXT NOT NULL, until REAL NOT NULL) WITHOUT ROWID;
"""


class TrialStore:
    """The trials of any number of searches, by key.

    Columns of the table `trials`: key, experiment, seed, config (JSON), versions (JSON),
    status (done or diverged), metrics (JSON), message, seconds, finished (UTC).

    Args:
        path: of the file; made if there is none.
        create: if False, a missing file is an error.

    Raises:
        StoreError: damaged, of another version of the schema, or not a store at all.
        OutputError: it cannot be opened or written.
        InvalidArgumentError: no such file, with create=False.
    """

    def __init__(self, path: str | Path, *, create: bool = True) -> None:
        self.path = Path(path)
        if not create and not self.path.is_file():
            raise InvalidArgumentError("store", "an existing file", self.path)
        self._owner = own_name()
        self._file: tuple[int, int] | None = None  # while it is being opened
        with self._translated():
            self._db = sqlite3.connect(self.path, timeout=_PATIENCE, isolation_level=None)
        try:
            with self._translated():
                self._open()
            self._file = _identity(self.path)
        except BaseException:
            self._db.close()
            raise

    def __enter__(self) -> "TrialStore":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Give back all claims and close the file."""
        with suppress(sqlite3.Error):
            self._db.execute("DELETE FROM claims WHERE owner = ?", [self._owner])
        self._db.close()

    def __len__(self) -> int:
        with self._translated():
            return int(self._db.execute("SELECT count(*) FROM trials").fetchone()[0])

    def outcomes(self, keys: Sequence[str]) -> dict[str, Outcome]:
        """Outcomes of those trials that are finished, by key.

        Raises:
            StoreError: a damaged row.
        """
        found: dict[str, Outcome] = {}
        with self._translated():
            for some in _batches(keys):
                rows = self._db.execute(
                    "SELECT key, status, metrics, message, seconds, versions FROM trials"
                    f" WHERE key IN ({','.join('?' * len(some))})",
                    some,
                )
                for key, status, metrics, message, seconds, versions in rows:
                    if status not in (DONE, DIVERGED) or not isinstance(seconds, float):
                        raise self._damaged(key, f"status {status!r}, seconds {seconds!r}")
                    metrics, versions = self._decoded(key, metrics, versions)
                    found[key] = Outcome(status, metrics, message, seconds, versions)
        return found

    def claim(self, keys: Sequence[str]) -> set[str]:
        """Those of the trials that are ours to run: not finished, and nobody else runs them."""
        mine: set[str] = set()
        with self._transaction():
            for key in keys:
                if self._db.execute("SELECT 1 FROM trials WHERE key = ?", [key]).fetchone():
                    continue
                held = self._db.execute(
                    "SELECT owner, until FROM claims WHERE key = ?", [key]
                ).fetchone()
                if held is None or held[0] == self._owner or not is_held(*held):
                    self._db.execute(
                        "INSERT OR REPLACE INTO claims VALUES (?, ?, ?)",
                        [key, self._owner, time.time() + LEASE],
                    )
                    mine.add(key)
        return mine

    def renew(self) -> None:
        """Keep our claims: call it well within LEASE seconds."""
        with self._transaction():
            self._db.execute(
                "UPDATE claims SET until = ? WHERE owner = ?", [time.time() + LEASE, self._owner]
            )

    def add(self, trial: Trial, outcome: Outcome) -> None:
        """Keep a finished trial; if there is one of its key, that one stays."""
        finished = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
        row = [
            trial.key, trial.experiment, trial.seed, _text(plain(trial.config)),
            _text(outcome.versions), outcome.status, _text(outcome.metrics), outcome.message,
            outcome.seconds, finished,
        ]  # fmt: skip
        with self._transaction():
            self._db.execute(
                f"INSERT OR IGNORE INTO trials VALUES ({','.join('?' * len(row))})", row
            )
            self._db.execute("DELETE FROM claims WHERE key = ?", [trial.key])

    def rows(self) -> Iterator[dict[str, Any]]:
        """All trials, JSON decoded, in the order of their keys.

        Raises:
            StoreError: a damaged row.
        """
        with self._translated():
            cursor = self._db.execute("SELECT * FROM trials ORDER BY key")
            names = [column[0] for column in cursor.description]
            for values in cursor:
                row = dict(zip(names, values, strict=True))
                documents = [row[name] for name in _DOCUMENTS]
                yield row | dict(
                    zip(_DOCUMENTS, self._decoded(row["key"], *documents), strict=True)
                )

    # --- inside ------------------------------------------------------------------------------

    def _decoded(self, key: str, *texts: str) -> list[dict[str, Any]]:
        try:
            found = [json.loads(text) for text in texts]
        except (TypeError, ValueError, RecursionError) as error:
            raise self._damaged(key, error) from error
        for document in found:
            if not isinstance(document, dict):
                raise self._damaged(key, f"{document!r:.60} is no JSON object")
        return found

    def _damaged(self, key: str, fault: object) -> StoreError:
        return StoreError(f"{self.path}: the row of trial {key} is damaged ({fault}); {_RESCUE}")

    def _open(self) -> None:
        self._db.execute(f"PRAGMA busy_timeout = {round(1e3 * _PATIENCE)}")
        if self._is_empty():
            self._create()
        if self._pragma("application_id") != APPLICATION:  # read now: who made it may be another
            raise StoreError(f"{self.path}: a database, but not a store of mcmj's trials")
        if (schema := self._pragma("user_version")) != SCHEMA:
            raise StoreError(
                f"{self.path}: a store of schema version {schema}, this mcmj has version {SCHEMA};"
                " use the mcmj that wrote it (it can export to CSV), or another file"
            )
        fault = self._pragma("quick_check")
        if fault != "ok":
            raise StoreError(f"{self.path}: damaged ({fault}); {_RESCUE}")
        self._use_write_ahead_log()
        self._db.execute("PRAGMA synchronous = NORMAL")
        with self._transaction():  # a read-only file is refused now and not after the first trial
            self._db.execute("DELETE FROM claims WHERE until < ?", [time.time()])

    def _create(self) -> None:
        self._use_write_ahead_log()
        with self._transaction():
            # else another process was faster, or it is another program's, still empty
            if self._is_empty() and self._pragma("application_id") == 0:
                for statement in _TABLES.split(";")[:-1]:
                    self._db.execute(statement)
                self._db.execute(f"PRAGMA application_id = {APPLICATION}")
                self._db.execute(f"PRAGMA user_version = {SCHEMA}")

    def _use_write_ahead_log(self) -> None:
        """Wait for others by ourselves: SQLite's busy timeout does not hold for this."""
        deadline = time.monotonic() + _PATIENCE
        while True:
            try:
                self._db.execute("PRAGMA journal_mode = WAL")
                return
            except sqlite3.OperationalError as error:
                busy = error.sqlite_errorcode & 0xFF == sqlite3.SQLITE_BUSY
                if not busy or time.monotonic() > deadline:
                    raise
                time.sleep(_RETRY)

    def _is_empty(self) -> bool:
        return bool(self._db.execute("SELECT count(*) FROM sqlite_master").fetchone()[0] == 0)

    def _pragma(self, name: str) -> Any:
        return self._db.execute(f"PRAGMA {name}").fetchone()[0]

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        """All or nothing; waits until no other process writes."""
        with self._translated():
            self._db.execute("BEGIN IMMEDIATE")
            try:
                if self._file not in (None, _identity(self.path)):
                    raise OutputError(
                        f"{self.path}: deleted or replaced while it was in use; trials that "
                        "finished since are lost: put it back, or run the same command again"
                    )
                yield
                self._db.execute("COMMIT")
            except BaseException:
                if self._db.in_transaction:
                    self._db.execute("ROLLBACK")
                raise

    @contextmanager
    def _translated(self) -> Iterator[None]:
        """SQLite's errors as ours, saying what to do."""
        try:
            yield
        except sqlite3.Error as error:
            raise _as_ours(self.path, error) from error


_DOCUMENTS = ("config", "versions", "metrics")
_RESCUE = (
    "nothing was changed; `sqlite3 FILE .recover` may save its trials, or start with another file"
)
_REASONS = {
    sqlite3.SQLITE_FULL: "the disk is full; finished trials are kept: make room and run again",
    sqlite3.SQLITE_READONLY: "read-only; give --store a file that can be written",
    sqlite3.SQLITE_CANTOPEN: "cannot be opened or made there; give --store another file",
    sqlite3.SQLITE_PERM: "no permission; give --store a file that can be written",
    sqlite3.SQLITE_IOERR: "the disk does not take it; finished trials are kept",
    sqlite3.SQLITE_BUSY: f"another program has locked it for over {_PATIENCE:g} s",
}


def _as_ours(path: Path, error: sqlite3.Error) -> StoreError | OutputError:
    code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR) & 0xFF
    if code in (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB):
        return StoreError(f"{path}: damaged, or not a store of trials ({error}); {_RESCUE}")
    return OutputError(f"{path}: {_REASONS.get(code, 'SQLite failed')} ({error})")


def _identity(path: Path) -> tuple[int, int] | None:
    """What tells a file from another one of its name."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def _text(value: object) -> str:
    return json.dumps(value, sort_keys=True, allow_nan=False)


def _batches(keys: Sequence[str]) -> Iterator[Sequence[str]]:
    for first in range(0, len(keys), _BATCH):
        yield keys[first : first + _BATCH]
