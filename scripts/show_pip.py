"""pip install with one line that says how far it is: python show_pip.py ARGUMENT...

On a terminal the line is drawn over and over; in a log there is one every 10 s. pip's own text is
shown if it fails.
"""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import threading
import time
from pathlib import Path

EVERY = (0.2, 10.0)  # seconds between lines on a terminal; in a log
WHEEL = re.compile(r"(?:Downloading|Using cached|Processing) (\S+)\.whl(?!\.)(?: \((.*?)\))?")
UNITS = {"kB": 1e-3, "MB": 1.0, "GB": 1e3}


class Progress:
    """What pip has said so far."""

    def __init__(self) -> None:
        self.start = time.monotonic()
        self.lines: list[str] = []
        self.packages, self.size, self.last = 0, 0.0, ""
        self.total, self.site = 0, Path(sysconfig.get_path("purelib"))
        self.before: set[str] = set()

    def hear(self, line: str) -> None:
        """Take in a line of pip's."""
        self.lines.append(line)
        wheel = WHEEL.match(line.strip())
        if wheel:
            name, version = (*Path(wheel[1]).name.split("-"), "")[:2]
            size = self.size_of(wheel)
            self.packages, self.size = self.packages + 1, self.size + size
            self.last = f"{name} {version}" + (f", {size:.0f} MB" if size >= 1.0 else "")
        elif line.startswith("Installing collected packages: "):
            self.before = self.there()
            self.total = line.count(",") + 1

    def size_of(self, wheel: re.Match[str]) -> float:
        """MB of a wheel: as pip says, or of the local file."""
        if wheel[2] and wheel[2].split()[-1] in UNITS:
            number, unit = wheel[2].split()[-2:]
            return float(number) * UNITS[unit]
        file = Path(f"{wheel[1]}.whl")
        return file.stat().st_size / 1e6 if file.is_file() else 0.0

    def there(self) -> set[str]:
        """Packages that are in place."""
        return {path.name for path in self.site.glob("*.dist-info")}

    def __str__(self) -> str:
        so_far = f"{self.packages} packages, {self.size:.0f} MB"
        if self.total:
            done = min(len(self.there() - self.before), self.total)
            doing = f"installing {done} of {self.total} packages"
        elif self.packages:
            doing = f"fetching {so_far} so far ({self.last})"
        else:
            doing = "asking what is needed"
        return f"mcmj: {doing}, {time.monotonic() - self.start:.0f} s"


def draw(progress: Progress, stop: threading.Event, live: bool) -> None:
    """Show the line until told to stop."""
    while not stop.wait(EVERY[not live]):
        line = str(progress)
        if live:
            line = f"\r\033[K{line[: shutil.get_terminal_size().columns - 1]}"
        print(line, end="" if live else "\n", flush=True)
    if live:
        print("\r\033[K", end="", flush=True)


def main() -> int:
    """Run pip; its exit status."""
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--no-input", "install"]
    progress, stop = Progress(), threading.Event()
    live = sys.stdout.isatty() and os.environ.get("TERM") != "dumb"
    # open files are for pip too: one of them is the lock of run.sh, free once all have ended
    with subprocess.Popen(
        [*pip, "--progress-bar=off", *sys.argv[1:]], stdout=subprocess.PIPE, text=True,
        errors="replace", close_fds=False,
    ) as process:  # fmt: skip
        drawing = threading.Thread(target=draw, args=(progress, stop, live))
        drawing.start()
        try:
            assert process.stdout is not None
            for line in process.stdout:
                progress.hear(line)
            process.wait()
        except KeyboardInterrupt:  # pip has it too
            return 130
        finally:
            stop.set()
            drawing.join()
    if process.returncode:
        print("".join(progress.lines[-20:]), end="")
    else:
        fetched = f"{progress.size:.0f} MB to fetch"
        took = f"{time.monotonic() - progress.start:.0f} s"
        print(f"mcmj: installed {progress.total} packages ({fetched}) in {took}", flush=True)
    return process.returncode


if __name__ == "__main__":
    sys.exit(main())
