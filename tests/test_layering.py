"""The house: imports point downwards, folders are small; read from the source by ast."""

import ast
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import mcmj

PACKAGE = Path(mcmj.__file__).parent
MODULES = {
    ".".join(path.relative_to(PACKAGE).with_suffix("").parts): path
    for path in sorted(PACKAGE.rglob("*.py"))
    if path.name != "__init__.py"
}

# a package imports only packages that stand before it
RANKS = (
    "utils",
    "core",
    "targets",
    "metrics",
    "mjcf",
    "reference",
    "simulation",
    "learning",
    "analysis",
    "robots",
    "pictures",
    "search",
    "experiments",
    "__main__",
)
# a folder within a package, and the side of the other modules of the package that it is on
BELOW = {
    "analysis.loops",
    "core.callbacks",
    "reference.twin",
    "simulation.stepsize",
    "simulation.models",
}  # they import it
ABOVE = {
    "analysis.stability",
    "learning.environments",
    "pictures.web_page",
    "pictures.window",
    "simulation.trajectory_files",
}
MOST_MODULES, MOST_ROOT_ENTRIES = 14, 16

MUJOCO = {
    "analysis.loops.chart",
    "core.callbacks.install",
    "core.callbacks.offsets",
    "experiments.adopt.suite_models",
    "experiments.benchmark.full_scene",
    "experiments.benchmark.lean",
    "experiments.benchmark.models",
    "experiments.benchmark.run",
    "experiments.limit_cycle.loop_cost",  # times bare mj_step
    "learning.environments.environment",
    "mjcf.body_model",
    "mjcf.check",
    "mjcf.kept",
    "mjcf.read",
    "mjcf.without_tendons",
    "pictures.opengl",
    "pictures.opengl_view",
    "pictures.trunk_video",
    "pictures.film",
    "pictures.model_view",
    "pictures.window.body_viewer",
    "pictures.window.plots",
    "pictures.window.viewer",
    "pictures.walk_video",
    "robots.ground",
    "robots.energy",
    "robots.trunk_walker",
    "robots.walk_scene",
    "simulation.batch_engine",
    "simulation.corrected_run",
    "simulation.damage",
    "simulation.interactive",
    "simulation.model_engine",
    "simulation.models.adopt",
    "simulation.models.compiled",
    "simulation.models.damage",
    "simulation.models.names",
    "simulation.models.reservoir_file",
    "simulation.reservoir",
    "utils.quiet",
}
EXTRAS = {
    "xarray": {"simulation.trajectory_files.zarr"},
    "sklearn": {"learning.estimator"},
    "h5py": {"simulation.trajectory_files.openprc"},
    "gymnasium": {"learning.environments.gymnasium_env"},
    "dm_control": {"experiments.adopt.suite_models", "learning.environments.environment"},
    "dm_env": {"learning.environments.environment"},
}


@cache
def imports(name):
    """Full names that a module imports, also inside functions."""
    found = []
    for node in ast.walk(ast.parse(MODULES[name].read_text())):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name}: relative import"
            found += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return found


def own_imports(name):
    """Modules of mcmj that a module imports."""
    found = {full.removeprefix("mcmj.") for full in imports(name) if full.startswith("mcmj.")}
    return found & MODULES.keys()


GRAPH = {name: own_imports(name) for name in MODULES}


def reachable(name):
    """All modules of mcmj that come along with a module."""
    seen, todo = set(), [name]
    while todo:
        new = GRAPH[todo.pop()] - seen
        seen |= new
        todo += new
    return seen


def outside(name):
    """Top-level names of other packages that a module imports."""
    return {full.split(".")[0] for full in imports(name)} - {"mcmj"}


def folder(name):
    return name.rpartition(".")[0]


def test_the_graph_is_read():
    assert {"mjcf.write", "mjcf.read"} <= GRAPH["mjcf.body_model"]
    assert "numpy" in outside("core.body")
    assert len(MODULES) > 150


def test_no_cycles():
    try:
        TopologicalSorter(GRAPH).prepare()
    except CycleError as error:
        pytest.fail(f"import cycle: {' -> '.join(reversed(error.args[1]))}")


@pytest.mark.parametrize("name", MODULES)
def test_packages_import_only_packages_of_lower_rank(name):
    rank = RANKS.index(name.split(".")[0])
    for other in GRAPH[name]:
        assert RANKS.index(other.split(".")[0]) <= rank, f"{name} imports {other}"


@pytest.mark.parametrize("name", MODULES)
def test_folders_within_a_package_are_on_one_side_of_it(name):
    for other in GRAPH[name]:
        one, two = folder(name), folder(other)
        if one in BELOW:
            assert one == two or not two.startswith(one.split(".")[0]), f"{name} imports {other}"
        if two in ABOVE:
            assert one == two or not one.startswith(two.split(".")[0]), f"{name} imports {other}"


def test_every_folder_has_a_side():
    inner = {folder(name) for name in MODULES if name.count(".") > 1}
    assert {one for one in inner if not one.startswith("experiments.")} == BELOW | ABOVE


def test_folders_are_small_and_say_what_lives_there():
    for place in {path.parent for path in MODULES.values()}:
        modules = [path for path in place.glob("*.py") if path.name != "__init__.py"]
        assert len(modules) <= MOST_MODULES, place
        assert ast.get_docstring(ast.parse((place / "__init__.py").read_text())), place
    # what an update leaves behind holds caches only
    entries = [path for path in PACKAGE.iterdir() if path.is_file() or any(path.glob("*.py"))]
    assert len(entries) <= MOST_ROOT_ENTRIES
    assert {path.name for path in entries if path.is_dir()} | {"__main__"} == set(RANKS)


@pytest.mark.parametrize("name", [n for n in MODULES if n.startswith(("targets.", "metrics."))])
def test_plain_numerics_need_no_engine(name):
    assert all("mujoco" not in outside(module) for module in {name, *reachable(name)})


@pytest.mark.parametrize("name", [n for n in MODULES if n.startswith("pictures.")])
def test_pictures_take_results_and_never_teach(name):
    assert not {module for module in GRAPH[name] if module.startswith("learning.")}, name


def test_mujoco_is_imported_in_few_places():
    assert {name for name in MODULES if "mujoco" in outside(name)} == MUJOCO


@pytest.mark.parametrize("package", EXTRAS)
def test_extras_are_imported_only_where_they_are_needed(package):
    """A plain installation can import everything that most users do."""
    users = {name for name in MODULES if package in outside(name)}
    assert users == EXTRAS[package]
    for name in ("simulation.simulation", "pictures.rendering", "experiments.limit_cycle.command"):
        assert not users & reachable(name)


def test_no_module_uses_a_global_random_state():
    """Randomness comes from utils.seeds.stream, or from a generator with a seed of its own."""
    for name, path in MODULES.items():
        calls = {
            ast.unparse(node.func)
            for node in ast.walk(ast.parse(path.read_text()))
            if isinstance(node, ast.Call)
        }
        random = {c for c in calls if c.startswith(("np.random.", "random.", "numpy.random."))}
        seeded = {c for c in random if c.startswith(("np.random.default_rng", "np.random.Seed"))}
        assert random == seeded, f"{name}: {random - seeded}"
        assert "np.random.default_rng()" not in path.read_text(), name
