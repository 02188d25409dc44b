"""Numba's cache where it cannot be written, or is cut off: a temporary one, and a warning line."""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

import mcmj

# root without the right to write where file permissions forbid it
BOUND = ["setpriv", "--bounding-set", "-dac_override,-dac_read_search"]
RUN = (
    "import mcmj, os; mcmj.Simulation(mcmj.random_body(1, nodes=6)).rollout(5);"
    "print(os.environ.get('NUMBA_CACHE_DIR'))"
)


@pytest.fixture
def place(tmp_path):
    """A home with a copy of the package."""
    folder = tmp_path / "home"
    source = Path(mcmj.__file__).parent
    shutil.copytree(source, folder / "mcmj", ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def run(place, *prefix, **environment):
    ours = ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")
    inherited = {name: value for name, value in os.environ.items() if name not in ours}
    done = subprocess.run(
        [*prefix, sys.executable, "-c", RUN], cwd="/", capture_output=True, text=True,
        env=inherited | {"PYTHONPATH": str(place), "HOME": str(place)} | environment,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.strip(), done.stderr


def test_a_read_only_package_and_home(place):
    root = hasattr(os, "geteuid") and os.geteuid() == 0
    if root and shutil.which(BOUND[0]) is None:
        pytest.skip("permissions do not bind root")
    folders = [place, *(folder for folder in place.rglob("*") if folder.is_dir())]
    for folder in folders:
        folder.chmod(0o555)
    try:
        cache, warned = run(place, *(BOUND if root else []))
    finally:
        for folder in folders:
            folder.chmod(0o755)
    assert "can be written: compiled code goes to a temporary folder" in warned
    assert warned.count("\n") == 1
    assert cache.startswith(tempfile.gettempdir())
    assert not Path(cache).exists()


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "own_folder"), [("nbi", True), ("nbc", False)])
def test_a_cache_that_is_cut_off(kind, own_folder, place):
    environment = {"NUMBA_CACHE_DIR": str(place / "cache")} if own_folder else {}
    expected = environment.get("NUMBA_CACHE_DIR", "None")
    assert run(place, **environment) == (expected, "")
    file = next(f for f in place.rglob(f"install*.{kind}"))
    os.truncate(file, file.stat().st_size - 1)
    cache, warned = run(place, **environment)
    assert f"{file} is damaged (delete it): " in warned
    assert warned.count("\n") == 1
    assert cache != expected
    file.unlink()
    assert run(place, **environment) == (expected, "")


@pytest.mark.slow
def test_code_of_other_sources_is_never_run(place):
    """Numba does not see that a function which a compiled one calls, in another file, changed."""
    twin = "import mcmj; body = mcmj.random_body(1, nodes=6);"
    twin += "run = mcmj.Simulation(body, engine='twin').rollout(50, offset=[[3.0, 1.0]] * 50);"
    twin += "print(repr(run.lengths[-1, 0]))"

    def length():
        return subprocess.run(
            [sys.executable, "-c", twin], cwd="/", capture_output=True, text=True, check=True,
            env=os.environ | {"PYTHONPATH": str(place), "HOME": str(place)},
        ).stdout  # fmt: skip

    before = length()
    assert length() == before
    source = place / "mcmj" / "reference" / "twin" / "stepping.py"
    law = "pull = x1 * (k1 + k3 * x1 * x1)"
    assert law in source.read_text()
    source.write_text(source.read_text().replace(law, "pull = x1 * (k1 + k1 + k3 * x1 * x1)"))
    assert length() != before
