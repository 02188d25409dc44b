"""Compiled code: shared by all checkouts of the same sources, never of others; lost, no harm."""

import ast
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

import mcmj
from mcmj.utils import compiled_cache

# root without the right to write where file permissions forbid it
BOUND = ["setpriv", "--bounding-set", "-dac_override,-dac_read_search"]
# two modules of compiled code, one calls the other
ONE = """
from numba import njit
@njit(cache=True)
def one():
    return 1.0
"""
TWO = """
from numba import njit
from mcmj.metrics.one import one
@njit(cache=True)
def two(x):
    return x * one()
"""
USE = """
import os
from mcmj.metrics.two import two
print(two(2.0), os.environ.get("NUMBA_CACHE_DIR"))
"""
ALL = """
import mcmj
body = mcmj.random_body(1, nodes=6)
for engine in ("mujoco", "twin"):
    run = mcmj.Simulation(body, engine=engine).rollout(50, offset=[[3.0, 1.0]] * 50)
    print(repr(run.lengths[-1, 0]))
"""
PACKAGE = Path(mcmj.__file__).parent


@pytest.fixture
def place(tmp_path):
    """A home with a copy of the package."""
    return copy_to(tmp_path / "home")


def copy_to(folder):
    shutil.copytree(PACKAGE, folder / "mcmj", ignore=shutil.ignore_patterns("__pycache__"))
    for name, text in (("one", ONE), ("two", TWO)):
        (folder / "mcmj" / "metrics" / f"{name}.py").write_text(text)
    return folder


def start(code, place, *prefix, home=None, **environment):
    ours = ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "MCMJ_CACHE_DIR")
    inherited = {name: value for name, value in os.environ.items() if name not in ours}
    home = {"PYTHONPATH": str(place), "HOME": str(home or place)}
    return subprocess.Popen(  # -B: Python's own cache takes edits within a second for the same file
        [*prefix, sys.executable, "-B", "-c", code], cwd="/", env=inherited | home | environment,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def end(process):
    out, err = process.communicate(timeout=300)
    assert process.returncode == 0, err
    return out.strip(), err


def run(code, place, *prefix, **options):
    return end(start(code, place, *prefix, **options))


def files_of(home):
    """When the files of compiled code were written."""
    cache = home / ".cache" / "mcmj" / "compiled"
    return {file: file.stat().st_mtime_ns for file in cache.rglob("*.nb[ic]")}


def check_shared(code, place, elsewhere):
    shown, err = run(code, place)
    assert not err
    written = files_of(place)
    assert not list((place / "mcmj").rglob("*.nb[ic]"))
    other = copy_to(elsewhere)
    for source in other.rglob("*.py"):
        os.utime(source, (1e9, 1e9))
    assert run(code, other, home=place) == (shown, "")
    assert files_of(place) == written
    return written


def test_a_second_checkout_compiles_nothing(place, tmp_path):
    assert len(check_shared(USE, place, tmp_path / "elsewhere" / "other")) == 4


@pytest.mark.slow
def test_of_callbacks_and_twins_a_second_checkout_compiles_nothing(place, tmp_path):
    assert len(check_shared(ALL, place, tmp_path / "other")) > 60


def test_code_of_other_sources_is_never_run(place):
    """Numba does not see that a function which a compiled one calls, in another file, changed."""
    assert run(USE, place)[0] == "2.0 None"
    one = place / "mcmj" / "metrics" / "one.py"
    one.write_text(ONE.replace("1.0", "3.0"))
    assert run(USE, place)[0] == "6.0 None"
    written = files_of(place)
    assert len(written) == 8
    one.write_text(ONE)
    assert run(USE, place)[0] == "2.0 None"
    assert files_of(place) == written


@pytest.mark.parametrize("edited", ["one", "two"])
def test_an_edit_while_a_process_runs_reaches_no_other(edited, place):
    """It has imported one file as it was; the others, as they are now, are not for all."""
    file = place / "mcmj" / "metrics" / f"{edited}.py"
    text = file.read_text()
    imported = "import mcmj.metrics.one, pathlib; "
    changed = {"one": text.replace("1.0", "3.0"), "two": text.replace("x *", "7 * x *")}[edited]
    edit = f"pathlib.Path({str(file)!r}).write_text({changed!r})\n"
    before = imported if edited == "two" else imported.replace("mcmj.metrics.one", "mcmj.metrics")
    assert run(before + edit + USE, place)[0] != "2.0 None"
    file.write_text(text)
    assert run(USE, place)[0] == "2.0 None"


@pytest.mark.slow
def test_two_processes_compile_at_one_time(place):
    (first, _), (second, _) = map(end, [start(ALL, place), start(ALL, place)])
    assert first == second
    written = files_of(place)
    assert run(ALL, place) == (first, "")
    assert files_of(place) == written


@pytest.mark.parametrize("jit", ["0", "1"])
def test_with_and_without_compilation(jit, place):
    assert run(USE, place, NUMBA_DISABLE_JIT=jit) == ("2.0 None", "")
    assert len(files_of(place)) == (0 if jit == "1" else 4)


def test_a_read_only_package_and_home(place):
    root = hasattr(os, "geteuid") and os.geteuid() == 0
    if root and shutil.which(BOUND[0]) is None:
        pytest.skip("permissions do not bind root")
    folders = [place, *(folder for folder in place.rglob("*") if folder.is_dir())]
    for folder in folders:
        folder.chmod(0o555)
    try:
        shown, warned = run(USE, place, *(BOUND if root else []))
    finally:
        for folder in folders:
            folder.chmod(0o755)
    assert "can be written: compiled code goes to a temporary folder" in warned
    assert warned.count("\n") == 1
    cache = shown.split()[-1]
    assert cache.startswith(tempfile.gettempdir())
    assert not Path(cache).exists()


def test_without_a_home_it_goes_to_the_package(place):
    assert run(USE, place, home="/dev/null")[1] == ""
    assert list((place / "mcmj" / "__pycache__" / "compiled").rglob("*.nbc"))


@pytest.mark.parametrize("kind", ["nbi", "nbc"])
def test_a_file_that_is_cut_off_is_made_anew(kind, place):
    cache = place / "cache"
    shown, _ = run(USE, place, NUMBA_CACHE_DIR=str(cache))
    file = next(cache.rglob(f"two*.{kind}"))
    size = file.stat().st_size
    os.truncate(file, size - 1)
    assert run(USE, place, NUMBA_CACHE_DIR=str(cache)) == (shown, "")
    assert file.stat().st_size == size
    assert not files_of(place)


def test_folders_of_old_sources_go(tmp_path, monkeypatch):
    monkeypatch.setattr(compiled_cache, "KEPT", 3)
    for age in range(6):
        folder = tmp_path / str(age)
        folder.mkdir()
        os.utime(folder, (1e9 - age, 1e9 - age))
    compiled_cache._forget_others(tmp_path)
    assert {folder.name for folder in tmp_path.iterdir()} == {"0", "1", "2"}


def test_the_digest_covers_what_compiled_code_imports():
    """Constants are compiled in: of mcmj only what the digest covers, and checks of input."""
    covered = {str(file.relative_to(PACKAGE)) for file in compiled_cache._sources()}
    for name in covered:
        for node in ast.walk(ast.parse((PACKAGE / name).read_text())):
            if isinstance(node, ast.ImportFrom) and "njit" in (PACKAGE / name).read_text():
                full = node.module or ""
                file = full.removeprefix("mcmj.").replace(".", "/") + ".py"
                plain = ("mcmj.utils.errors", "mcmj.utils.validation")
                assert not full.startswith("mcmj.") or file in covered or full in plain, name
