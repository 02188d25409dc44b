"""Stable steps, measured and predicted."""

import numpy as np
from matplotlib.figure import Figure

from mcmj.experiments.hard_cases.result import STEPS, Result
from mcmj.pictures.plotting import new_figure
from mcmj.utils.colours import BLACK, BLUE, GREEN, GREY, TARGET_COLOUR

PLAIN_STEP = 1e-3  # s: what a simulation takes unless told otherwise
TOP = 2.0  # s: unbounded steps are drawn here


def figures(result: Result) -> dict[str, Figure]:
    """By file name."""
    return {"hard_cases": step_figure(result)}


def step_figure(result: Result) -> Figure:
    """One panel an integrator, one row a case."""
    integrators, cases = result.config.integrators, result.config.cases
    figure = new_figure(2.2 * len(integrators) + 1.8, 4.6)
    axes = figure.subplots(1, len(integrators), sharex=True, sharey=True, squeeze=False)[0]
    rows = np.arange(len(cases))
    for panel, integrator in zip(axes, integrators, strict=True):
        found = [row for row in result.rows if row.integrator == integrator]
        steps = np.array([[getattr(row, name) for row in found] for name in STEPS])
        measured, at_rest, low, high = np.minimum(steps[:4], np.minimum(steps[4], TOP))
        panel.hlines(rows, low, high, color=BLUE, alpha=0.45, lw=9,
                     label="predicted along the motion")  # fmt: skip
        panel.plot(steps[4], rows, "|", color=GREY, ms=11, mew=1,
                   label="longest that resolves the motion")  # fmt: skip
        panel.plot(at_rest, rows, "|", color=GREEN, ms=11, mew=2,
                   label="predicted at rest")  # fmt: skip
        panel.plot(measured, rows, "o", color=BLACK, ms=3, label="measured")
        panel.axvline(PLAIN_STEP, color=TARGET_COLOUR, ls="--", lw=1, label="1 ms")
        panel.set(xscale="log", title=integrator, xlim=(1e-8, 1.6 * TOP))
        panel.set_xticks([1e-7, 1e-5, 1e-3, 1e-1])
        panel.set_yticks(rows, [name.replace("_", " ") for name in cases])
        panel.grid(alpha=0.3)
    axes[0].invert_yaxis()
    figure.supxlabel(
        "largest stable step [s]; on the grey mark: any that resolves the motion", fontsize=9
    )
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=5, frameon=False)
    return figure
