"""Imports point downwards only: read from the source by ast, nothing is run."""

import ast
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise
from pathlib import Path

import pytest

import mcmj

PACKAGE = Path(mcmj.__file__).parent
MODULES = {
    ".".join(path.relative_to(PACKAGE).with_suffix("").parts): path
    for path in sorted(PACKAGE.rglob("*.py"))
    if path.name != "__init__.py"
}

# each module may import only modules of rows above its own
LEVELS = (
    ("errors",),
    ("validation",),
    ("streams", "spring_laws", "structs"),
    ("options",),
    ("body",),
    ("generator", "appearance"),
    ("laws",),
    ("mjcf",),
    ("bodyfile",),
    ("drive", "trajectory"),
    ("engine",),
    ("simulation",),
    ("ensemble",),
    ("lessons",),
    ("teaching",),
)
CHAINS = (
    *pairwise(LEVELS),
    (("errors",), ("validation",)),
    (("validation",), ("targets",)),
    (("targets",), ("metrics",)),
    (("targets",), ("gaits",)),
    (("gaits", "metrics"), ("experiments.gaits_config",)),
    (("metrics",), ("gaitmetrics",)),
    (("gaitmetrics",), ("gaitplot",)),
    (("validation",), ("readout",)),
    (("readout", "targets", "lessons"), ("teaching",)),
    (("phases",), ("schedule",)),
    (("experiments.benchmark_config",), ("experiments.benchmark_process",)),
    (("experiments.benchmark_process",), ("experiments.benchmark",)),
    (("errors",), ("store",)),
    (("teaching", "metrics"), ("heldout",)),
    (("heldout",), ("selection",)),
    (("readout",), ("pruning",)),
    (("errors",), ("metricpath",)),
    (("metricpath",), ("reproduction.claims",)),
    (("search.overrides", "search.space", "metricpath"), ("search.experiment",)),
    (("search.experiment",), ("search.database",)),
    (("search.database", "search.workers"), ("search.runner",)),
    (("search.runner",), ("experiments.search",)),
    (("simulation", "metrics"), ("experiments.limit_cycle",)),
    (("lawtable",), ("spring_laws",)),
    (("spring_laws",), ("coupled_laws",)),
    (("body",), ("arrays",)),
    (("coupled_laws", "arrays"), ("emulation",)),
    (("simulation",), ("probing",)),
    (("theory", "capacity", "filter_tasks"), ("probing",)),
    (("targets", "profiles"), ("driven",)),
    (("teaching", "driven"), ("experiments.input_lessons",)),
    (("generator", "gaits"), ("trunk",)),
    (("trunk",), ("trunk_walker",)),
    (("trunk_walker", "rls"), ("force_learning",)),
    (("force_learning",), ("experiments.trunk",)),
    (("environment_setting", "environment_task"), ("environment",)),
    (("walkscene",), ("walklaw",)),
    (("walklaw", "walkmetrics", "legs"), ("walker",)),
    (("walker",), ("grounding",)),
)
MUJOCO = {
    "alteration",
    "bodycheck",
    "bodyfile",
    "engine",
    "experiments.benchmark",
    "experiments.full_scene",
    "experiments.limit_cycle_config",  # reads the model of a body file
    "experiments.loop_cost",  # times bare mj_step
    "glview",
    "laws",
    "leapfrog",
    "live",
    "quiet",
    "simulation",
    "structs",
    "viewer",
    "trunk_walker",
    "trunkvideo",
    "walker",
    "walkscene",
    "walkvideo",
}


def imports(name):
    """Full names that a module imports, also inside functions."""
    for node in ast.walk(ast.parse(MODULES[name].read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name}: relative import"
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


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


def test_the_graph_is_read():
    assert {"mjcf", "bodyfile", "drive"} <= GRAPH["engine"]
    assert "numpy" in outside("body")
    assert len(MODULES) > 20


def test_no_cycles():
    try:
        TopologicalSorter(GRAPH).prepare()
    except CycleError as error:
        pytest.fail(f"import cycle: {' -> '.join(reversed(error.args[1]))}")


@pytest.mark.parametrize(("lower", "upper"), CHAINS)
def test_lower_modules_do_not_import_upper_ones(lower, upper):
    missing = {*lower, *upper} - MODULES.keys()
    assert not missing, f"renamed? {missing}"
    for name in lower:
        assert not reachable(name) & set(upper)


def test_levels_do_not_import_their_own_level_or_any_above():
    for i, level in enumerate(LEVELS):
        above = {name for other in LEVELS[i:] for name in other}
        for name in level:
            assert not reachable(name) & above, name


@pytest.mark.parametrize(
    "name",
    [
        "targets",
        "metrics",
        "readout",
        "body",
        "generator",
        "store",
        "theory",
        "arrays",
        "capacity",
        "filter_tasks",
    ],
)
def test_plain_numerics_need_no_engine(name):
    assert not reachable(name) & {"mjcf", "laws", "engine", "simulation", "ensemble"}
    assert all("mujoco" not in outside(module) for module in {name, *reachable(name)})


def test_plotting_takes_results_and_never_simulates():
    forbidden = {"simulation", "ensemble", "engine", "teaching", "laws", "mjcf", "bodyfile"}
    for name in ("plotting", "searchplot"):
        assert not reachable(name) & forbidden
        assert not any(other.startswith("experiments.") for other in reachable(name))


def test_library_does_not_know_its_experiments_or_command_lines():
    for name in MODULES:
        if not name.startswith("experiments."):
            above = {m for m in GRAPH[name] if m.startswith("experiments.") or m == "cli"}
            assert not above, name


def test_mujoco_is_imported_in_few_places():
    assert {name for name in MODULES if "mujoco" in outside(name)} <= MUJOCO


@pytest.mark.parametrize("package", ["xarray", "zarr", "h5py", "gymnasium", "dm_control"])
def test_extras_are_imported_only_where_they_are_needed(package):
    """A plain installation can import everything that most users do."""
    users = {name for name in MODULES if package in outside(name)}
    assert users <= {"zarr_file", "openprc_file", "environment", "gymnasium_env"}
    for name in ("simulation", "rendering", "experiments.limit_cycle", "library", "bodyfile"):
        assert not users & reachable(name)


def test_pictures_take_films_and_never_simulate():
    forbidden = {"simulation", "ensemble", "engine", "teaching"}
    for name in ("film", "panel", "caption", "flatview", "glview", "rendering", "driveplot"):
        assert not reachable(name) & forbidden, name


def test_dm_control_is_imported_in_at_most_one_module():
    assert len([name for name in MODULES if "dm_control" in outside(name)]) <= 1


def test_no_module_uses_a_global_random_state():
    """Randomness comes from streams.stream, or from a generator with a seed of its own."""
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
