"""The wheel works without the repository: all of mcmj is in it, and the command `mcmj` runs."""

import json
import os
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PROGRAM = """
import mcmj
from mcmj.experiments.registry import entries
from mcmj.mjcf.bundled import body_names
print(mcmj.__file__, *body_names(), *entries())
"""
SHORT = (
    "--task quadratic --free-run 13 --window 12 --duration 8 --washout 2 --rounds 0 "
    "--trial 13 --trial-window 12 --no-video"
)
pytestmark = pytest.mark.slow


def done(*command, **where):
    ran = subprocess.run(command, capture_output=True, text=True, check=False, **where)
    assert ran.returncode == 0, ran.stderr
    return ran.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    done(sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", folder, ROOT)
    return next(folder.glob("mcmj-*.whl"))


@pytest.fixture(scope="module")
def run(wheel, tmp_path_factory):
    """Runs a program of an environment of its own, in an empty folder that it returns first.

    The wheel is installed there; what it needs comes from the environment of the tests.
    """
    place, empty = tmp_path_factory.mktemp("environment"), tmp_path_factory.mktemp("empty")
    python = place / "bin" / "python"
    done(sys.executable, "-m", "venv", "--without-pip", place)
    install = [sys.executable, "-m", "pip", "--quiet", "--python", python, "install"]
    done(*install, "--no-deps", "--no-index", wheel)
    site = done(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))").strip()
    (Path(site) / "needed.pth").write_text(sysconfig.get_path("purelib"))
    others = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}

    def run(program, *options):
        return empty, done(place / "bin" / program, *options, cwd=empty, env=others)

    return run


def test_all_of_mcmj_is_in_the_wheel_and_nothing_else(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    info = f"{wheel.name.split('-py3')[0]}.dist-info"
    assert {name.split("/")[0] for name in names} == {"mcmj", info}
    kinds = ("*.py", "web_page/*.html", "web_page/*.css", "web_page/*.js")
    modules = {str(p.relative_to(ROOT)) for kind in kinds for p in (ROOT / "mcmj").rglob(kind)}
    bodies = {f"mcmj/{path.relative_to(ROOT)}" for path in (ROOT / "bodies").rglob("*.xml")}
    assert {name for name in names if name.startswith("mcmj/")} == {
        "mcmj/py.typed", *modules, *bodies
    }  # fmt: skip


def test_it_is_the_wheels_and_finds_its_bodies_and_experiments(run):
    empty, shown = run("python", "-c", PROGRAM)
    where, *names = shown.split()
    assert ROOT not in Path(where).parents
    assert "site-packages" in where
    bodies = sorted(path.stem for path in (ROOT / "bodies").glob("*.xml"))
    folders = sorted(path.parent.name for path in ROOT.glob("mcmj/experiments/*/command.py"))
    assert names == [*bodies, *folders]
    assert not list(empty.iterdir())


def test_the_command_runs_an_experiment_in_an_empty_folder(run):
    _, shown = run("mcmj", "--help")
    assert "limit_cycle" in shown
    empty, shown = run("mcmj", "limit_cycle", *SHORT.split(), "--no-measure-cost")
    assert "results in results/limit_cycle-task=quadratic" in " ".join(shown.split())
    (metrics,) = empty.glob("results/*/metrics.json")
    document = json.loads(metrics.read_text())
    assert document["scenario"] == "limit_cycle"
    assert 0 <= document["metrics"]["quadratic"]["orbit_error"] < 1
