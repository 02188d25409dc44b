"""Feedback linearisability by Lie brackets, and why arrays of linear springs need diversity."""

from pathlib import Path

from rich.console import Console
from rich.table import Table

from mcmj import store
from mcmj.cli import Output, main
from mcmj.experiments.linearise import Config, Result, run, total_arrays
from mcmj.plotting import save
from mcmj.progress import progress_bar
from mcmj.theoryplot import diversity_figure


def work(config: Config, output: Output, out: Path) -> None:
    with progress_bar("arrays", total_arrays(config), quiet=output.quiet) as on_arrays:
        result = run(config, on_arrays=on_arrays)
    store.write_text(out / "linearisability.txt", report(result))
    errors = {n: e[:-1] for n, e in result.errors.items()}
    equal = {n: e[-1] for n, e in result.errors.items()}
    figure = diversity_figure(
        config.diversities,
        {n: c[:-1] for n, c in result.conditions.items()},
        {n: r[:-1] for n, r in result.ranks.items()},
        errors,
        equal,
    )
    save(figure, out / "linearise.png")
    store.write_metrics(out / "metrics.json", "linearise", config, config.seed, result.metrics)
    if not output.quiet:
        print(report(result))
        show(result, out)


def report(result: Result) -> str:
    return "\n\n".join(str(one) for one in result.reports) + "\n"


def show(result: Result, out: Path) -> None:
    config = result.config
    table = Table(title="arrays of linear springs, from diverse to equal")
    table.add_column("diversity", justify="right")
    for n in config.sizes:
        table.add_column(f"rank of {2 * n}", justify="right")
    for n in config.memory_sizes:
        table.add_column(f"NRMSE, {n} springs", justify="right")
    for place, spread in enumerate(config.spreads):
        ranks = [str(result.ranks[n][place]) for n in config.sizes]
        errors = [f"{result.errors[n][place]:.3f}" for n in config.memory_sizes]
        table.add_row(f"{spread:g}", *ranks, *errors)
    console = Console(width=20 + 13 * (len(config.sizes) + len(config.memory_sizes)))
    console.print(table)
    console.print(f"the same filter without a body: NRMSE {result.baseline:.3f}")
    console.print(f"results in {out}")


if __name__ == "__main__":
    main("linearise", Config, work)
