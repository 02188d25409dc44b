"""Without a package of an extra there is one clear error, which says how to install it."""

import subprocess
import sys

import pytest

USE = """
import sys
sys.modules[{package!r}] = None  # as if it were not installed
from mcmj.utils.errors import McmjError, MissingExtraError
try:
    {use}
except MissingExtraError as error:
    assert isinstance(error, McmjError)
    print(error)
"""
STUDY = "from mcmj.search.study import Study; Study('s', {}, {'x': 1}, 0, startup=1, maximise=True)"
EVOLUTION = "from mcmj.search.evolution import Evolution; Evolution(2, 0, spread=1.0, bound=2.0)"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("package", "extra", "use"),
    [
        ("sympy", "theory", "import mcmj.analysis.lie_brackets"),
        ("sympy", "theory", "import mcmj.experiments.emulate.command"),
        ("xarray", "files", "import mcmj.simulation.trajectory_files.zarr"),
        ("zarr", "files", "import mcmj.simulation.trajectory_files.zarr"),
        ("h5py", "files", "import mcmj.simulation.trajectory_files.openprc"),
        ("dm_control", "control", "import mcmj.learning.environments.environment"),
        ("dm_control", "control", "import mcmj.experiments.adopt.suite_models"),
        ("dm_env", "control", "import mcmj.learning.environments.environment"),
        ("gymnasium", "gym", "import mcmj.learning.environments.gymnasium_env"),
        ("sklearn", "sklearn", "import mcmj.learning.estimator"),
        ("optuna", "search", STUDY),
        ("cmaes", "design", EVOLUTION),
        ("pyarrow", "search", "import mcmj.search.export as e; e.write_parquet(None, 't.parquet')"),
        ("distributed", "cluster", "import mcmj.search.workers as w; w.Cluster('tcp://h:1')"),
    ],
)
def test_a_missing_extra_gives_the_install_command(package, extra, use):
    if extra in ("control", "gym"):  # packages that hide each other
        pytest.importorskip("dm_control")
    code = USE.format(package=package, use=use)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert not done.stderr
    assert f"pip install 'mcmj[{extra}]'" in done.stdout
    assert package in done.stdout
    assert done.stdout.count("\n") == 1
