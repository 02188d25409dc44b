"""The work-precision diagram: error over cost."""

import re
from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mcmj.core.integrators import INTEGRATORS
from mcmj.experiments.speed_accuracy.result import Cell, Result
from mcmj.pictures.plotting import INTEGRATOR_MARKS, new_figure
from mcmj.utils.colours import GREY, INTEGRATOR_COLOURS, Colour

STYLES = {  # name, integrator whose colour it is, and marks; dashed: the twins
    "mujoco_Euler_hook": ("MuJoCo: Euler, springs by callback", "Euler_hook", "o:"),
    "mujoco_RK4_hook": ("MuJoCo: RK4, springs by callback", "RK4_hook", "D:"),
    "twin_adaptive_leapfrog": ("twin: adaptive leapfrog", "adaptive_leapfrog", "*--"),
    "twin_toolbox_euler": ("authors' toolbox: Euler", "toolbox_euler", "x--"),
    "twin_toolbox_rk": ("authors' toolbox: Runge-Kutta", "toolbox_rk", "+--"),
}
for _name, _mark in INTEGRATOR_MARKS.items():
    STYLES[f"mujoco_{_name}"] = f"MuJoCo: {_name}", _name, _mark + "-"
    if INTEGRATORS[_name].twin:
        STYLES[f"twin_{INTEGRATORS[_name].twin}"] = f"twin: {_name}", _name, _mark + "--"
COLUMNS = 4


def figures(result: Result) -> dict[str, Figure]:
    """By file name."""
    return {"speed_accuracy": work_precision_figure(result)}


def work_precision_figure(result: Result) -> Figure:
    """Error over cost, a panel a body, a curve a method, a point a step."""
    cells, methods = result.cells, _apart(result.config.methods)
    rows = -(-(len(cells) + 1) // COLUMNS)
    figure = new_figure(3.1 * COLUMNS, 3.2 * rows)
    grid = figure.subplots(rows, COLUMNS, sharey=True, squeeze=False)
    flat = grid.ravel()
    for axes, (body, by_method) in zip(flat, cells.items(), strict=False):
        _draw_body(axes, body, {method: by_method[method] for method in methods})
    for axes in grid[:, 0]:
        axes.set_ylabel("relative position error")
    handles = []
    for method in methods:
        name, colour, marks = _style(method)
        order = result.orders[method]
        slope = f" (order {order.slope:.1f})" if order is not None else ""
        handles += flat[-1].plot([], [], marks, color=colour, ms=4, label=name + slope)
    for axes in flat[len(cells) :]:
        axes.axis("off")
    flat[len(cells)].legend(handles=handles, loc="center", frameon=False, fontsize=8.5)
    return figure


def _apart(methods: Sequence[str]) -> list[str]:
    """Without those by callback beside the same without: their curves are the same."""
    return [m for m in methods if not m.endswith("_hook") or m.removesuffix("_hook") not in methods]


def _draw_body(axes: Axes, body: str, methods: Mapping[str, Mapping[float, Cell]]) -> None:
    for method, steps in methods.items():
        _, colour, marks = _style(method)
        good = [(cell.cost_ratio, cell.error) for cell in steps.values() if cell.error < 1.0]
        if good:
            costs, errors = zip(*good, strict=True)
            axes.loglog(costs, errors, marks, color=colour, ms=4, lw=1.2)
    axes.axvline(1.0, color="0.8", lw=1, zorder=0)
    axes.set(xlabel="cost / Euler at 1 ms", xlim=(3e-3, 1e2), ylim=(1e-11, 1.0))
    axes.set_title(re.sub(r"toolbox n(\d+)", r"\1 nodes", body.replace("_", " ")))
    axes.grid(alpha=0.25)


def _style(method: str) -> tuple[str, Colour, str]:
    name, integrator, marks = STYLES.get(method, (method.replace("_", " "), "", ".-"))
    return name, INTEGRATOR_COLOURS.get(integrator, GREY), marks
