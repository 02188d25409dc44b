"""What every experiment is, and what is done around its run: folder, bar, files, figures, exit."""

import sys
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from mcmj.core.integrators import DEFAULT_INTEGRATOR
from mcmj.mjcf.write import to_mjcf
from mcmj.pictures.plotting import save
from mcmj.utils import files
from mcmj.utils.progress import OnSteps, progress_bar


@dataclass(frozen=True)
class Output:
    """Where results go.

    Attributes:
        out: folder for metrics.json and the figures; default: results/<command>.
        quiet: no progress bars and no table.
        video: make videos.
        json: print the metrics as JSON instead of a table.
    """

    out: Path | None = None
    quiet: bool = False
    video: bool = True
    json: bool = False


@dataclass(frozen=True)
class Experiment:
    """One experiment: a config, a run from it to a result, and what is made of the result.

    The result has `metrics`, a mapping that survives JSON. Everything else is optional.

    Attributes:
        name: of the command and of the folder in mcmj.experiments.
        config: a frozen dataclass whose defaults are a full run; its fields are the options.
        run: run(config, on_steps=..) -> result; also folder=.. if it `needs_folder`.
        bar: bar(config, quiet) -> the block's progress function, see mcmj.utils.progress.
        seed: of a config, for metrics.json.
        write: write(result, folder): files besides metrics.json and the figures.
        figures: figures(result) -> a figure by file name.
        film: film(result, folder), made last.
        show: show(result, console): tables for people.
        verdict: raises McmjError if the run did not do what was asked; all is written by then.
        clean_up: removes what an interrupted run would have gone on from.
        needs_folder: the run itself writes into the folder of the results.
        page: config.page names a web page, which `--out NAME.html` may name with its folder.
        resumes: it does, and an interrupted run goes on from what it left there.
    """

    name: str
    config: type[Any]
    run: Callable[..., Any]
    bar: Callable[[Any, bool], AbstractContextManager[Callable[[Any], object]]]
    show: Callable[[Any, Console], object]
    seed: Callable[[Any], int] = lambda config: config.seed
    write: Callable[[Any, Path], object] = lambda result, folder: None
    figures: Callable[[Any], Mapping[str, Figure]] = lambda result: {}
    film: Callable[[Any, Path], object] | None = None
    verdict: Callable[[Any], object] = lambda result: None
    clean_up: Callable[[Any], object] = lambda result: None
    needs_folder: bool = False
    resumes: bool = False
    page: bool = False

    @property
    def about(self) -> str:
        """What it is for: the docstring of its folder in mcmj, or of a module of one's own."""
        module = self.config.__module__
        place = module.rpartition(".")[0] if module.startswith("mcmj.experiments.") else module
        return sys.modules[place].__doc__ or ""


def counting(
    label: str, total: Callable[[Any], int]
) -> Callable[[Any, bool], AbstractContextManager[OnSteps]]:
    """A bar over what a run counts, steps or bodies or tasks: `total` of a config."""
    return lambda config, quiet: progress_bar(label, total(config), quiet=quiet)


def table_of(title: str, *columns: str, words: int = 1) -> Table:
    """An empty table: so many columns of words, the others of numbers."""
    table = Table(*columns[:words], title=title)
    for name in columns[words:]:
        table.add_column(name, justify="right")
    return table


def write_body(result: Any, source: Mapping[str, object], folder: Path) -> None:
    """body.xml: a result's body with all its readouts, the first of them active.

    Args:
        result: with config, body, readouts by name and stepping, arguments of the Simulation.
        source: where the body comes from.
    """
    config, readouts = result.config, result.readouts
    xml = to_mjcf(
        result.body,
        timestep=config.timestep,
        integrator=result.stepping.get("integrator", DEFAULT_INTEGRATOR),
        w_out=next(iter(readouts.values()), None),
        readouts=readouts,
        provenance={"body": source, "config": files.plain(config)},
    )
    files.write_text(folder / "body.xml", xml)


def carry_out(experiment: Experiment, config: Any, output: Output, folder: Path) -> None:
    """Run an experiment into an existing folder: data first, then pictures, then the table.

    Raises:
        McmjError: the run, or writing its results, failed.
    """
    where = {"folder": folder} if experiment.needs_folder else {}
    with experiment.bar(config, output.quiet) as on_steps:
        try:
            result = experiment.run(config, on_steps=on_steps, **where)
        except KeyboardInterrupt:
            if experiment.resumes:
                print(f"{experiment.name}: the same command goes on from here", file=sys.stderr)
            raise
    experiment.write(result, folder)
    seed = experiment.seed(config)
    files.write_metrics(folder / "metrics.json", experiment.name, config, seed, result.metrics)
    for name, figure in experiment.figures(result).items():
        save(figure, folder / f"{name}.png")
    experiment.clean_up(result)
    if output.video and experiment.film is not None:
        experiment.film(result, folder)
    if not output.quiet:
        console = Console()
        experiment.show(result, console)
        console.print(f"results in {folder}")
    experiment.verdict(result)
