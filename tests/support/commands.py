"""Running the scripts as a user does, each in a process of its own."""

import json
import subprocess
import sys
from pathlib import Path

SCRIPTS = Path(__file__).parents[2] / "scripts"


def start(name, *options, **popen):
    return subprocess.Popen(
        [sys.executable, SCRIPTS / f"{name}.py", *map(str, options)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **popen,
    )  # fmt: skip


def run(name, *options):
    process = start(name, *options)
    out, err = process.communicate(timeout=240)
    return process.returncode, out, err


def metrics_of(folder):
    """A command's metrics.json, which is complete."""
    document = json.loads((folder / "metrics.json").read_text())
    assert set(document) == {"scenario", "config", "seed", "versions", "metrics"}
    assert document["versions"]["mujoco"]
    return document
