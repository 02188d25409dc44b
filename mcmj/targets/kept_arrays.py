"""Arrays that take long to compute, kept in the user's cache folder from one process to the next.

What is kept can always be computed again: a file that is damaged, or a folder that cannot be
written, costs time and nothing else. Of the files in the folder only the newest stay.
"""

import hashlib
import json
import os
import zipfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

import numpy as np

from mcmj.utils.files import cache_folder, plain
from mcmj.utils.validation import Array

MOST_FILES = 64
ACCOUNT = "account"  # in a file, beside the arrays


def kept_arrays(
    kind: str, account: object, compute: Callable[[], Mapping[str, Array]]
) -> dict[str, Array]:
    """The arrays of `compute`, from the cache if they are there.

    Args:
        kind: the first part of the file's name.
        account: all that the arrays depend on, as JSON types, dataclasses or arrays.
    """
    text = json.dumps(plain(account), sort_keys=True)
    name = f"{kind}-{hashlib.sha256(text.encode()).hexdigest()[:32]}.npz"
    try:
        path = cache_folder() / name
    except RuntimeError:
        return dict(compute())
    found = _read(path, text)
    if found is None:
        found = dict(compute())
        with suppress(OSError):
            _write(path, text, found)
    return found


def _read(path: Path, text: str) -> dict[str, Array] | None:
    """The arrays of a whole file of that account; checksums are the archive's."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        return arrays if str(arrays.pop(ACCOUNT)) == text else None
    except (OSError, ValueError, KeyError, AttributeError, EOFError, zipfile.BadZipFile):
        return None


def _write(path: Path, text: str, arrays: Mapping[str, Array]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{os.getpid()}-{path.name}")
    try:
        with temporary.open("wb") as file:
            contents = {ACCOUNT: np.array(text), **arrays}
            np.savez(file, **contents)  # type: ignore[arg-type]  # names of arrays, not options
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
    files = sorted(path.parent.glob("*.npz"), key=lambda one: one.stat().st_mtime)
    for old in files[:-MOST_FILES]:
        old.unlink(missing_ok=True)
