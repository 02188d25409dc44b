"""Where a long run stands, on disk: what it needs to go on bit for bit after an interruption.

Two files: <stem>.outputs holds all outputs so far as raw float64, only ever appended to, and
<stem>.npz the rest, replaced whole, with a SHA-256 of all that is kept. The hash of the outputs
runs along: the cost of a save does not grow with the run.
"""

import hashlib
import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

import numpy as np

from mcmj.utils import files
from mcmj.utils.errors import CheckpointError, OutputError
from mcmj.utils.validation import Array


class Checkpoint:
    """One run's checkpoint.

    Args:
        stem: path of its files, without suffix.
        account: all that the run's bits depend on (configuration, body); the versions of the
            packages are added. A checkpoint of anything else is not used.
        n_outputs: columns of the outputs.
    """

    def __init__(self, stem: Path, account: object, n_outputs: int) -> None:
        self._state = stem.with_name(stem.name + ".npz")
        self._outputs = stem.with_name(stem.name + ".outputs")
        self._account = json.dumps(files.plain([account, files.versions()]), sort_keys=True)
        self._n_outputs = n_outputs
        self._rows, self._hash = 0, hashlib.sha256()  # of the outputs that are kept

    @property
    def rows(self) -> int:
        """Number of rows of outputs that are kept, of the last `load` or `save`."""
        return self._rows

    def load(self) -> tuple[dict[str, Array], Array] | None:
        """The arrays and all outputs (T, n_outputs) of the last save, if there are any.

        Raises:
            CheckpointError: a file is damaged, or cannot be read.
        """
        self._rows, self._hash = 0, hashlib.sha256()
        if not self._state.exists():
            return None
        try:
            with self._state.open("rb") as file, np.load(file, allow_pickle=False) as found:
                arrays = dict(found)
            if str(arrays["account"]) != self._account:
                return None
            digest, rows = str(arrays.pop("digest")), int(arrays["steps"])
        except Exception as error:  # NumPy and zipfile raise many kinds
            raise self._damaged("it cannot be read") from error
        values = self._read_outputs(rows)
        running = hashlib.sha256(values.data)
        if _digest(running, arrays) != digest:
            raise self._damaged("its SHA-256 is another")
        self._rows, self._hash = rows, running
        del arrays["account"], arrays["steps"]
        return arrays, values.reshape(-1, self._n_outputs)

    def save(self, arrays: Mapping[str, Array], new_outputs: Array) -> None:
        """Add outputs (M, n_outputs) to the `rows` there are, then replace the rest.

        Raises:
            OutputError: the disk does not take it.
            CheckpointError: outputs that were kept are gone.
        """
        new = np.ascontiguousarray(new_outputs, dtype=np.float64).tobytes()
        try:
            self._append(new)
        except OSError as error:
            raise OutputError(f"cannot write {self._outputs}: {error.strerror}") from error
        rows, running = self._rows + len(new_outputs), self._hash.copy()
        running.update(new)
        kept = {"account": np.array(self._account), "steps": np.array(rows), **arrays}
        with files.whole_file(self._state) as temporary, temporary.open("wb") as target:
            digest = np.array(_digest(running, kept))
            np.savez(target, digest=digest, **kept)  # type: ignore[arg-type]  # no option's name
        self._rows, self._hash = rows, running

    def remove(self) -> None:
        """Delete both files, and what killed runs left half-written."""
        left = self._state.parent.glob(f".[0-9]*-{self._state.name}")
        for path in (self._state, self._outputs, *left):  # in this order: outputs alone are ignored
            with suppress(OSError):
                path.unlink(missing_ok=True)

    def _append(self, new: bytes) -> None:
        if not self._rows:
            self._state.unlink(missing_ok=True)  # another run's: its outputs go now
        with self._outputs.open("r+b" if self._rows else "wb") as file:
            if file.seek(0, os.SEEK_END) < self._size(self._rows):
                raise self._damaged("outputs are missing")
            file.seek(self._size(self._rows))
            file.truncate()  # what an interrupted save left
            file.write(new)
        files.sync(self._outputs)

    def _read_outputs(self, rows: int) -> Array:
        try:
            if 0 <= self._size(rows) <= self._outputs.stat().st_size:
                return np.fromfile(self._outputs, count=rows * self._n_outputs)
        except OSError as error:
            raise self._damaged(f"{self._outputs.name}: {error.strerror}") from error
        raise self._damaged("outputs are missing")

    def _size(self, rows: int) -> int:
        """Bytes of so many rows of outputs."""
        return 8 * rows * self._n_outputs

    def _damaged(self, what: str) -> CheckpointError:
        return CheckpointError(
            f"the checkpoint {self._state} is damaged ({what}): delete it to start anew"
        )


def _digest(outputs: "hashlib._Hash", arrays: Mapping[str, Array]) -> str:
    """SHA-256 of the outputs that were hashed and of all arrays with their names and shapes."""
    total = outputs.copy()
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        total.update(f"{name} {array.dtype.str} {array.shape}".encode() + array.tobytes())
    return total.hexdigest()
