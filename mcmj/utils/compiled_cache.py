"""Where Numba keeps compiled code: beside the sources, or in the user's cache folder.

Where neither can be written, or a file there is cut off (a killed process, a full disk), Numba
raises at import or in the middle of a run. Then a temporary folder takes their place.

Numba knows a function's code by the date of its own file, and does not look at what it calls in
other files: after an update it would run code of before. A stamp beside the cache names the
sources that it was compiled from; of others, it is emptied.
"""

import atexit
import functools
import hashlib
import os
import pickletools
import shutil
import tempfile
import warnings
from pathlib import Path

import numba

from mcmj.utils.errors import McmjWarning

_HERE = Path(__file__).parent
_PACKAGE = _HERE.parent
_COMPILED = ("core/callbacks", "reference/twin", "targets", "metrics")  # folders of compiled code


@functools.cache  # every package of compiled code asks, before it is imported
def ensure_cache() -> None:
    """Use a temporary folder, with a warning, if Numba's own cannot be used.

    The folder is removed when the process ends; those that it starts use it too.
    """
    trouble = _trouble()
    if trouble is None:
        return
    folder, owner = tempfile.mkdtemp(prefix="mcmj-numba-"), os.getpid()
    os.environ["NUMBA_CACHE_DIR"] = folder  # for processes that this one starts
    setattr(numba.config, "CACHE_DIR", folder)  # noqa: B010  (it declares none)

    def remove() -> None:
        if os.getpid() == owner:  # not in a forked child
            shutil.rmtree(folder, ignore_errors=True)

    atexit.register(remove)
    message = f"{trouble}: compiled code goes to a temporary folder, and is made anew each time"
    warnings.warn_explicit(message, McmjWarning, "mcmj", 0)  # one line: no source to show


def _trouble() -> str | None:
    """What is wrong with Numba's cache, None if nothing is."""
    if numba.config.DISABLE_JIT:  # type: ignore[attr-defined]  # Numba makes it late
        return None
    try:
        cache = numba.njit(cache=True)(_trouble).stats.cache_path or ""
    except RuntimeError:  # "no locator available"
        return "neither the package's folder nor the user's cache folder can be written"
    if not _is_of_these_sources(Path(cache)):
        return f"{cache} was compiled from other sources, and cannot be emptied"
    for file in _cached_files(Path(cache)):
        if not _is_whole(file):
            return f"{file} is damaged (delete it)"
    return None


def _is_of_these_sources(cache: Path) -> bool:
    """Whether the cache is of the sources as they are, emptied if need be."""
    digest = hashlib.blake2b(digest_size=8)
    for folder in _COMPILED:
        for source in sorted((_PACKAGE / folder).glob("*.py")):
            digest.update(source.name.encode() + source.read_bytes())
    stamp = cache / f"mcmj-{digest.hexdigest()}"
    if stamp.exists():
        return True
    try:
        for file in [*_cached_files(cache), *cache.glob("mcmj-*")]:
            file.unlink(missing_ok=True)
        cache.mkdir(parents=True, exist_ok=True)
        stamp.touch()
    except OSError:
        return False
    return True


def _cached_files(cache: Path) -> list[Path]:
    """Numba's files of this package, given the folder of those of this module."""
    if cache.parent == _HERE:
        return list(_PACKAGE.rglob("__pycache__/*.nb[ic]"))
    packages = {path.parent.name for path in _PACKAGE.rglob("*.py")}
    folders = [f for f in cache.parent.iterdir() if f.name.rpartition("_")[0] in packages]
    return [file for folder in folders for file in folder.glob("*.nb[ic]")]


def _is_whole(path: Path) -> bool:
    """Whether a file is one or more whole pickles; nothing is unpickled."""
    try:
        with path.open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            while file.tell() < size:
                for _ in pickletools.genops(file):
                    pass
            return size > 0
    except FileNotFoundError:  # another process replaced it
        return True
    except Exception:  # genops raises anything on what is no pickle
        return False
