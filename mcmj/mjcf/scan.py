"""What a body file may ask for, checked on its text before MuJoCo compiles it.

MuJoCo would read other files, expand a line to millions of elements and allocate any size.
"""

import math
import os
import stat
from pathlib import Path
from xml.parsers import expat

from mcmj.utils.errors import BodyFileError

MAX_BYTES = 128 * 2**20  # of a file, and of what it may make MuJoCo allocate
MAX_DEPTH = 100
REFUSED = {"include", "attach", "model", "replicate", "composite", "flexcomp", "plugin"}
COUNTS = {
    *("njmax", "nconmax", "nstack", "nuserdata", "nkey", "memory", "nsample", "width", "height"),
    *("nrow", "ncol", "offwidth", "offheight", "shadowsize", "offsamples"),
    *("numslices", "numstacks", "numquads"),
}
UNITS = {"k": 10, "m": 20, "g": 30, "t": 40, "p": 50, "e": 60}


def read_body_file(path: str | Path, max_bytes: int = MAX_BYTES) -> str:
    """The text of a regular file of at most `max_bytes`.

    Raises:
        BodyFileError: no such file, a FIFO or device, too large, or not UTF-8.
    """
    shown = str(path)[:200]
    try:  # without waiting: opening a FIFO blocks
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    except (OSError, ValueError) as error:  # also too long for a name, or with a null
        raise BodyFileError(f"no such body file: {shown!r}") from error
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise BodyFileError(f"{shown}: expected a regular file")
    with open(handle, "rb") as file:
        data = file.read(max_bytes + 1)
    if len(data) > max_bytes:
        raise BodyFileError(f"{shown}: expected at most {max_bytes} bytes (max_bytes)")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BodyFileError(f"{shown}: expected text in UTF-8 ({error})") from error


def scan(text: str, source: str, max_bytes: int = MAX_BYTES) -> None:
    """Refuse what reads other files, repeats elements, or asks for more than `max_bytes`.

    Raises:
        BodyFileError: such a text, or text that is not XML.
    """
    try:
        data = text.encode()
    except UnicodeEncodeError as error:
        raise BodyFileError(f"{source}: expected text in UTF-8 ({error})") from error
    if len(data) > max_bytes:
        raise BodyFileError(f"{source}: expected at most {max_bytes} bytes (max_bytes)")
    sums = _Sums(source, max_bytes)
    parser = expat.ParserCreate("utf-8")
    parser.StartDoctypeDeclHandler = sums.doctype
    parser.StartElementHandler = sums.start
    parser.EndElementHandler = sums.end
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise BodyFileError(f"{source}: not XML: {error}") from error
    sums.check(8 * sums.widest * sums.elements, "user data")


class _Sums:
    """What the elements so far ask for."""

    def __init__(self, source: str, max_bytes: int) -> None:
        self.source, self.max_bytes = source, max_bytes
        self.depth = self.elements = self.widest = 0
        self.total = 0.0

    def doctype(self, *_: object) -> None:
        raise BodyFileError(f"{self.source}: a body file has no DOCTYPE and no entities")

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self.depth += 1
        self.elements += 1
        if tag in REFUSED:
            raise BodyFileError(f"{self.source}: <{tag}> is not allowed in a body file")
        if self.depth > MAX_DEPTH:
            raise BodyFileError(f"{self.source}: expected at most {MAX_DEPTH} nested elements")
        asked = 1.0
        for name, value in attributes.items():
            if name.startswith("file"):
                raise BodyFileError(f"{self.source}: <{tag} {name}> would read another file")
            if name == "user":
                self.widest = max(self.widest, len(value.split()))
            elif name.startswith("nuser_"):
                self.widest = max(self.widest, int(min(self._count(name, value), 1e18)))
            elif name in COUNTS:
                asked *= max(1.0, self._count(name, value))
        self.total += (1 if "memory" in attributes else 8) * asked
        self.check(self.total, f"<{tag}>")

    def end(self, tag: str) -> None:
        self.depth -= 1

    def check(self, asked: float, what: str) -> None:
        if asked > self.max_bytes:
            raise BodyFileError(
                f"{self.source}: {what} asks for {asked:.3g} bytes, "
                f"expected at most {self.max_bytes} (max_bytes)"
            )

    def _count(self, name: str, value: str) -> float:
        text = value.strip().lower()
        scale = UNITS.get(text[-1:], 0) if name == "memory" else 0
        try:
            number = float(text[:-1] if scale else text)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise BodyFileError(f"{self.source}: {name}: expected a number, got {value[:40]!r}")
        return number * 2.0**scale
