"""The wheel works without the repository: package and bodies are in it, and nothing else."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PROGRAM = """
import mcmj
from mcmj.mjcf.bundled import body_names, body_path
body, w_out = mcmj.from_mjcf(body_path("van_der_pol"))
run = mcmj.Simulation(body, w_out=w_out).rollout(100)
print(mcmj.__file__, *body_names(), run.outputs.shape)
"""


@pytest.mark.slow
def test_the_wheel_works_without_the_repository(tmp_path):
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", tmp_path, ROOT]
    subprocess.run(build, check=True, capture_output=True, text=True)
    (wheel,) = tmp_path.glob("mcmj-*.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        archive.extractall(tmp_path / "site")
    tops = {name.split("/")[0] for name in names}
    assert tops == {"mcmj", f"{wheel.name.split('-py3')[0]}.dist-info"}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], cwd=tmp_path, capture_output=True, text=True, check=True,
        env=os.environ | {"PYTHONPATH": str(tmp_path / "site")},
    )  # fmt: skip
    where, *bodies = done.stdout.replace("(100, 2)", "").split()
    assert where.startswith(str(tmp_path / "site"))
    assert bodies == sorted(path.stem for path in (ROOT / "bodies").glob("*.xml"))
