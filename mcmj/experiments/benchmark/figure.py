"""How the cost of a step grows with the body."""

from typing import Any

from matplotlib.figure import Figure

from mcmj.experiments.benchmark.run import Result
from mcmj.pictures.plotting import new_figure
from mcmj.utils.colours import BLACK, BLUE


def figures(result: Result) -> dict[str, Figure]:
    """By file name."""
    return {"growth": growth_figure(result)}


def growth_figure(result: Result) -> Figure:
    """Cost of a step and of compiling against the number of springs."""
    rows: Any = result.metrics["growth"]
    figure = new_figure(9.0, 3.8)
    left, right = figure.subplots(1, 2)
    springs = [row["springs"] for row in rows]
    for engine, colour in (("mujoco", BLACK), ("twin", BLUE)):
        costs = [row[f"{engine}_ns_per_spring_step"] for row in rows]
        left.loglog(springs, costs, "o-", color=colour, label=engine)
    left.set(xlabel="springs", ylabel="cost [ns per spring and step]")
    left.legend(frameon=False)
    left.set_title("flat = linear in the size of the body")
    right.loglog(springs, [row["compile_seconds"] for row in rows], "o-", color="black")
    right.set(xlabel="springs", ylabel="time to build a Simulation [s]")
    for axes in (left, right):
        axes.grid(alpha=0.3, which="both")
    return figure
