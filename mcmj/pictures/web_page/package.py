"""The official WebAssembly build of MuJoCo: fetched by npm once, checked, kept in the cache."""

import base64
import gzip
import hashlib
import shutil
import subprocess
import tarfile
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from importlib.metadata import files
from pathlib import Path

from mcmj.utils.errors import PackageError
from mcmj.utils.files import cache_folder, prepare_folder, whole_file

VERSION = "3.14.0"
PACKAGE = f"@mujoco/mujoco@{VERSION}"
SHA512 = "WPUYidu4Fx8+uM4hQv80SOA0ifpWGrsNJguKs8JBV8SCTxjKQ2/rqsh880nUH0/Vwa8vuefghvCQkkoed3bkUg=="
LONGEST_FETCH = 300.0  # s
HOW = (
    f"`npm pack {PACKAGE}` on a machine with npm (it comes with Node.js) makes a .tgz file: "
    "give it as --package FILE"
)
WASM_HEADER = 8  # bytes: magic number and version
CUSTOM_SECTION = 0  # names and debugging: half of the file, never run


@dataclass(frozen=True)
class Package:
    """What a page needs of it.

    Attributes:
        javascript: the module that loads it.
        wasm: without what is for debugging only.
        licences: of MuJoCo and of what it is built from.
    Both of these by gzip, as base64.
    """

    javascript: str
    wasm: str
    licences: str


def open_package(given: Path | None = None) -> Package:
    """The package from a .tgz file; by default from the cache, or by npm from its registry.

    Raises:
        PackageError: no such file, another version, or it cannot be fetched.
    """
    path = _kept() if given is None else given
    if given is not None and not _is_it(path):
        raise PackageError(f"package: expected {PACKAGE} as a .tgz file, got {given}; {HOW}")
    with tarfile.open(path) as archive:
        javascript, wasm = (_member(archive, name) for name in ("mujoco.js", "mujoco.wasm"))
    return Package(
        javascript.decode(), packed(without_custom_sections(wasm)), packed(_licences().encode())
    )


def packed(data: bytes) -> str:
    """gzip, as base64; the same each time."""
    return base64.b64encode(gzip.compress(data, mtime=0)).decode()


def without_custom_sections(wasm: bytes) -> bytes:
    """A WebAssembly module without its custom sections, which never change what it does."""
    kept, at = [wasm[:WASM_HEADER]], WASM_HEADER
    while at < len(wasm):
        size, start = _unsigned(wasm, at + 1)
        if wasm[at] != CUSTOM_SECTION:
            kept.append(wasm[at : start + size])
        at = start + size
    return b"".join(kept)


def _unsigned(data: bytes, at: int) -> tuple[int, int]:
    """A LEB128 number, and where it ends: seven bits a byte, the lowest first."""
    value = shift = 0
    while True:
        byte = data[at]
        value |= (byte & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if byte < 0x80:
            return value, at


def _member(archive: tarfile.TarFile, name: str) -> bytes:
    file = archive.extractfile(f"package/{name}")
    assert file is not None  # the checksum was right
    return file.read()


def _is_it(path: Path) -> bool:
    """Whether a file has the checksum of the package."""
    try:
        digest = hashlib.sha512(path.read_bytes()).digest()
    except OSError:
        return False
    return base64.b64encode(digest).decode() == SHA512


def _kept() -> Path:
    """Its path in the cache, to which it is fetched if it is not there."""
    try:
        path = cache_folder() / f"mujoco-wasm-{VERSION}.tgz"
    except RuntimeError as error:
        raise PackageError(f"package: no folder to keep it in ({error}); {HOW}") from error
    if not _is_it(path):
        _fetch(path)
    return path


def _fetch(path: Path) -> None:
    npm = shutil.which("npm")
    if npm is None:
        raise PackageError(f"package: npm is not installed; {HOW}")
    with tempfile.TemporaryDirectory() as folder:
        try:
            done = subprocess.run(
                [npm, "pack", PACKAGE, "--silent"],
                cwd=folder, capture_output=True, text=True, check=False, timeout=LONGEST_FETCH,
            )  # fmt: skip
            said = " ".join(done.stderr.split())[-300:] or f"exit status {done.returncode}"
        except (OSError, subprocess.TimeoutExpired) as error:
            said = str(error)
        fetched = next(Path(folder).glob("*.tgz"), Path(folder, "none"))
        if not fetched.exists():
            raise PackageError(f"package: npm cannot fetch {PACKAGE} ({said}); {HOW}")
        if not _is_it(fetched):
            raise PackageError(f"package: what npm fetched as {PACKAGE} has another checksum")
        prepare_folder(path.parent)
        with whole_file(path) as temporary:
            shutil.copyfile(fetched, temporary)


def _licences() -> str:
    """The texts that come with MuJoCo's Python package; npm's has none."""
    found = [file for file in files("mujoco") or () if "LICENSE" in file.name]
    texts = []
    for file in sorted(found, key=lambda one: (len(one.name), one.name)):
        with suppress(OSError):
            texts.append(Path(str(file.locate())).read_text(encoding="utf-8"))
    if not texts:
        raise PackageError(
            "package: the licences of the installed mujoco are missing; install it again"
        )
    return "\n\n".join(texts)
