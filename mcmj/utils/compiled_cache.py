"""Where Numba keeps the code that it compiles for mcmj: once a machine, in the user's cache folder.

A folder's name is a digest of all sources of compiled code, the versions of Python and of Numba,
and the processor. So checkouts with the same sources share it; after an edit or an update, code of
before is not found. (Numba itself knows a function by its own file only, and does not look at what
it calls in other files.)

The place is NUMBA_CACHE_DIR if that is set, else `compiled` in mcmj's cache folder, else the
package itself; where none can be written, a temporary folder.
"""

import atexit
import functools
import hashlib
import os
import pickletools
import platform
import shutil
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from types import CodeType
from typing import Any

import llvmlite.binding
import numba
from numba.core.caching import CacheImpl, _CacheLocator

from mcmj.utils.errors import McmjWarning
from mcmj.utils.files import cache_folder

_PACKAGE = Path(__file__).parent.parent
# all that compiled code is made of
_COMPILED = ("core/callbacks", "reference/twin", "targets", "metrics")
_CONSTANTS = ("core/integrators.py", "utils/quiet.py")
FUNCTIONS: set[CodeType] = set()  # those of mcmj that Numba knows by now
KEPT = 8  # folders of other sources, processors or versions that stay, the last used


class _Locator(_CacheLocator):
    """The place of one function's compiled code, for Numba."""

    mixed = False  # a file was edited before it was imported: what comes now may call new code

    def __init__(self, function: Callable[..., object], file: Path, folder: Path) -> None:
        self._py_file, self._lineno = str(file), function.__code__.co_firstlineno
        self._name = str(file.relative_to(_PACKAGE))
        self._folder = folder
        _Locator.mixed |= _digest_of(file) != _sources()[file]
        self._stamp = os.urandom(8).hex() if _Locator.mixed else "of the digest"

    @classmethod
    def from_function(cls, py_func: Callable[..., object], py_file: str) -> "_Locator | None":
        file = Path(py_file)
        if file not in _sources():
            return None  # another package's
        FUNCTIONS.add(py_func.__code__)
        return cls(py_func, file, ensure_cache())

    def get_cache_path(self) -> str:
        return str(self._folder / self._name.removesuffix(".py").replace(os.sep, "."))

    def get_source_stamp(self) -> str:
        """Numba takes code of the same stamp only: where sources are mixed, of no other process."""
        return self._stamp

    def get_disambiguator(self) -> str:
        return str(self._lineno)


@functools.cache  # every package of compiled code asks, before it is imported
def ensure_cache() -> Path:
    """The folder for compiled code, made if need be; Numba uses it from now on.

    A temporary one, with a warning, if no other can be written. It is removed when the process
    ends; those that it starts use it too.
    """
    locators: list[Any] = CacheImpl._locator_classes  # Numba has no types
    locators.insert(0, _Locator)
    name = _name()
    for place in _places():
        folder = place / name
        if _is_usable(folder):
            _forget_others(place)
            return folder
    return _temporary() / name


def _places() -> Iterator[Path]:
    given = numba.config.CACHE_DIR  # type: ignore[attr-defined]  # Numba makes it late
    if given:
        yield Path(given) / "mcmj"
        return
    with suppress(RuntimeError):  # a user without a home
        yield cache_folder() / "compiled"
    yield _PACKAGE / "__pycache__" / "compiled"


def _name() -> str:
    """A digest of all that compiled code depends on."""
    binding = llvmlite.binding
    account = [f"{file.relative_to(_PACKAGE)} {digest}" for file, digest in _sources().items()]
    account += [platform.python_version(), numba.__version__, llvmlite.__version__]
    account += [binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten()]
    return hashlib.blake2b("\n".join(account).encode(), digest_size=16).hexdigest()


@functools.cache
def _sources() -> dict[Path, str]:
    """Digests of the files that compiled code is made of, as they were when first asked."""
    files = [_PACKAGE / name for name in _CONSTANTS]
    files += [file for name in _COMPILED for file in sorted((_PACKAGE / name).glob("*.py"))]
    return {file: _digest_of(file) for file in files}


def _digest_of(file: Path) -> str:
    return hashlib.blake2b(file.read_bytes(), digest_size=16).hexdigest()


def _is_usable(folder: Path) -> bool:
    """Whether it can be written; cut-off files, of a killed process or a full disk, are removed."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
        os.utime(folder)  # for `_forget_others`
        for file in folder.glob("*/*.nb[ic]"):
            if not _is_whole(file):
                file.unlink(missing_ok=True)
    except OSError:
        return False
    return True


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


def _forget_others(place: Path) -> None:
    """Remove all folders but those last used."""
    with suppress(OSError):
        folders = sorted(place.iterdir(), key=lambda one: one.stat().st_mtime)
        for old in folders[:-KEPT]:
            shutil.rmtree(old, ignore_errors=True)


def _temporary() -> Path:
    folder, owner = tempfile.mkdtemp(prefix="mcmj-numba-"), os.getpid()
    os.environ["NUMBA_CACHE_DIR"] = folder  # for processes that this one starts

    def remove() -> None:
        if os.getpid() == owner:  # not in a forked child
            shutil.rmtree(folder, ignore_errors=True)

    atexit.register(remove)
    message = (
        "neither the user's cache folder nor the package's can be written: compiled code goes to "
        "a temporary folder, and is made anew each time"
    )
    warnings.warn_explicit(message, McmjWarning, "mcmj", 0)  # one line: no source to show
    return Path(folder) / "mcmj"
