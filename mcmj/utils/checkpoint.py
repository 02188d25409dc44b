"""Where a long run stands, on disk: what it needs to go on bit for bit after an interruption.

Two files: <stem>.outputs holds all outputs so far as raw float64, only ever appended to, and
<stem>.npz the rest, replaced whole. The cost of a save does not grow with the run.
"""

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from mcmj.utils import files
from mcmj.utils.errors import OutputError
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

    def load(self) -> tuple[dict[str, Array], Array] | None:
        """The arrays and all outputs (T, n_outputs) of the last save, if there are any."""
        try:
            with np.load(self._state, allow_pickle=False) as file:
                arrays = dict(file)
            if str(arrays.pop("account")) != self._account:
                return None
            size = int(arrays.pop("steps")) * self._n_outputs
            values = np.fromfile(self._outputs, count=size)
        except (OSError, ValueError, KeyError, EOFError, BadZipFile):
            return None  # none, or damaged
        return (arrays, values.reshape(-1, self._n_outputs)) if len(values) == size else None

    def save(self, arrays: Mapping[str, Array], new_outputs: Array, before: int) -> None:
        """Add outputs (M, n_outputs) to the `before` rows there are, then replace the rest.

        Raises:
            OutputError: the disk does not take it.
        """
        try:
            with self._outputs.open("r+b" if before else "wb") as file:
                file.truncate(8 * before * self._n_outputs)  # what an interrupted save left
                file.seek(0, os.SEEK_END)
                file.write(np.ascontiguousarray(new_outputs).tobytes())
        except OSError as error:
            raise OutputError(f"cannot write {self._outputs}: {error.strerror}") from error
        steps = np.array(before + len(new_outputs))
        with files.whole_file(self._state) as temporary, temporary.open("wb") as target:
            np.savez(target, account=np.array(self._account), steps=steps, **arrays)  # type: ignore[arg-type]

    def remove(self) -> None:
        """Delete both files."""
        for path in (self._state, self._outputs):
            with suppress(OSError):
                path.unlink(missing_ok=True)
