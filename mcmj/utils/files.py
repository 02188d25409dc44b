"""Result files: whole or not at all, each with its config, seed and versions. No pickle.

And CSV files of the user's, as rows with their line numbers.
"""

import csv
import dataclasses
import functools
import json
import os
import platform
import shutil
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext, suppress
from contextvars import ContextVar
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from mcmj.utils.errors import InvalidArgumentError, OutputError

try:
    import fcntl
except ImportError:  # not a Unix
    fcntl = None  # type: ignore[assignment]  # a module elsewhere

_LOCKED: ContextVar[frozenset[Path]] = ContextVar("_LOCKED", default=frozenset())
_PACKAGES = ("mcmj", "mujoco", "numpy", "scipy", "numba")


def cache_folder() -> Path:
    """MCMJ_CACHE_DIR, or else mcmj in the system's place for caches; it need not exist yet.

    Raises:
        RuntimeError: the user has no home.
    """
    given = os.environ.get("MCMJ_CACHE_DIR")
    if given:
        return Path(given)
    if sys.platform == "win32":
        place = os.environ.get("LOCALAPPDATA") or str(Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        place = str(Path.home() / "Library" / "Caches")
    else:
        place = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(place) / "mcmj"


def versions() -> dict[str, str]:
    """Versions of what a result depends on."""
    return dict(_versions())


@functools.cache  # reading them takes milliseconds
def _versions() -> dict[str, str]:
    found = {"python": platform.python_version()}
    for package in _PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


def prepare_folder(folder: str | Path) -> Path:
    """Make a folder for results and check that it can be written, before any long work.

    Raises:
        OutputError: it cannot.
    """
    path = Path(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
        probe = path / f".probe-{os.getpid()}"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise OutputError(f"cannot write to the output folder {path}: {error.strerror}") from error
    return path


@contextmanager
def only_run(folder: str | Path) -> Iterator[None]:
    """Keep other runs out of a folder, also those of other processes, until the block ends.

    Blocks inside each other are one run. The lock goes with its process, however that ends.
    Where the system or the disk has no such locks, nothing is locked.

    Raises:
        OutputError: another run is at work there, or there is no such folder.
    """
    path = Path(folder).resolve()
    if path in _LOCKED.get() or fcntl is None:
        yield
        return
    handle, token = _lock(path), _LOCKED.set(_LOCKED.get() | {path})
    try:
        yield
    finally:
        _LOCKED.reset(token)
        os.close(handle)


def _lock(folder: Path) -> int:
    """Open a folder and lock it; closing it lets go."""
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError as error:
        raise OutputError(f"cannot open the output folder {folder}: {error.strerror}") from error
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(handle)
        raise OutputError(
            f"another run is at work in the output folder {folder}: wait for its end, or give "
            "another folder"
        ) from None
    except OSError:
        pass  # some network disks have no locks
    return handle


@contextmanager
def whole_file(path: str | Path, *, folder: bool = False) -> Iterator[Path]:
    """A temporary path beside `path` that takes its place if the block succeeds.

    It is on the disk before it does: a machine that stops leaves the old file or the new one.

    Args:
        folder: for formats that are folders; the block gets an empty one to fill.

    Raises:
        OutputError: the disk or the folder does not take it.
    """
    final = Path(path)
    temporary = final.with_name(f".{os.getpid()}-{final.name}")
    try:
        if folder:
            temporary.mkdir()
        yield temporary
        for path_inside in temporary.rglob("*") if folder else ():
            sync(path_inside)
        sync(temporary)
        if folder:  # only an empty one can be replaced
            shutil.rmtree(final, ignore_errors=True)
        os.replace(temporary, final)
        sync(final.parent)
    except OutputError:
        raise  # says already what failed
    except OSError as error:
        raise OutputError(f"cannot write {final}: {error.strerror or error}") from error
    finally:
        with suppress(OSError):
            if folder:
                shutil.rmtree(temporary, ignore_errors=True)
            else:
                temporary.unlink(missing_ok=True)


def sync(path: Path) -> None:
    """Have a file or folder on the disk, as it is now, before this returns.

    Raises:
        OSError: the disk does not take it.
    """
    with suppress(OSError) if path.is_dir() else nullcontext():  # not all systems sync folders
        handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def write_text(path: str | Path, text: str) -> None:
    """Write a text file, whole or not at all."""
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_metrics(
    path: str | Path, scenario: str, config: object, seed: int, metrics: Mapping[str, object]
) -> None:
    """metrics.json: {"scenario", "config", "seed", "versions", "metrics"}."""
    document = {
        "scenario": scenario,
        "config": plain(config),
        "seed": seed,
        "versions": versions(),
        "metrics": plain(metrics),
    }
    write_text(path, json.dumps(document, indent=2, allow_nan=False) + "\n")


def write_arrays(
    path: str | Path, arrays: Mapping[str, np.ndarray], config: object, seed: int
) -> None:
    """An NPZ file of arrays, with config, seed and versions as JSON text in `provenance`.

    Not compressed: outputs have few zeros, and lose 7 % in a second for 40 MB.
    """
    for name, array in arrays.items():
        if np.asarray(array).dtype.hasobject:
            raise InvalidArgumentError(f"arrays[{name!r}]", "numbers, not Python objects", array)
    with whole_file(path) as temporary, temporary.open("wb") as file:
        origin = np.array(json.dumps(account(config, seed)))
        contents: dict[str, Any] = {"provenance": origin, **arrays}
        np.savez(file, **contents)


def account(config: object, seed: int) -> dict[str, object]:
    """Where a file comes from: config, seed and versions, as JSON types."""
    return {"config": plain(config), "seed": seed, "versions": versions()}


def plain(value: object) -> object:
    """`value` with dataclasses, arrays, paths and NumPy numbers as JSON types; NaN as null."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    if value is None or isinstance(value, bool | int | str):
        return value
    return str(value)


def csv_rows(path: str | Path, name: str, expected: str) -> list[tuple[int, list[str]]]:
    """Line number and cells of every row that is not empty.

    Args:
        name, expected: the argument that the file was given as, and what it may be.

    Raises:
        InvalidArgumentError: the file cannot be read, or is not text.
    """
    try:
        with Path(path).open(encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file)
            return [(reader.line_num, cells) for cells in reader if "".join(cells).strip()]
    except (OSError, ValueError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or error
        raise InvalidArgumentError(name, expected, f"{path}: {reason}") from error
