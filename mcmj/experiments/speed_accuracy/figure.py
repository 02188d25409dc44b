"""The work-precision diagram: error over cost."""

from collections.abc import Mapping

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mcmj.core.integrators import INTEGRATORS
from mcmj.experiments.speed_accuracy.result import Cell, Result
from mcmj.pictures.plotting import INTEGRATOR_MARKS, new_figure
from mcmj.utils.colours import GREY, INTEGRATOR_COLOURS, Colour

STYLES = {  # integrator, whose colour it is, and marks; dashed: the twins
    "mujoco_Euler_hook": ("Euler_hook", "o:"),
    "mujoco_RK4_hook": ("RK4_hook", "D:"),
    "twin_adaptive_leapfrog": ("adaptive_leapfrog", "*--"),
    "twin_toolbox_euler": ("toolbox_euler", "x--"),
    "twin_toolbox_rk": ("toolbox_rk", "+--"),
}
for _name, _mark in INTEGRATOR_MARKS.items():
    STYLES[f"mujoco_{_name}"] = _name, _mark + "-"
    if INTEGRATORS[_name].twin:
        STYLES[f"twin_{INTEGRATORS[_name].twin}"] = _name, _mark + "--"
COLUMNS = 4


def figures(result: Result) -> dict[str, Figure]:
    """By file name."""
    return {"speed_accuracy": work_precision_figure(result)}


def work_precision_figure(result: Result) -> Figure:
    """Error over cost, a panel a body, a curve a method, a point a step."""
    cells = result.cells
    rows = -(-(len(cells) + 1) // COLUMNS)
    figure = new_figure(4.0 * COLUMNS, 3.9 * rows)
    grid = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
    for axes, (body, methods) in zip(grid, cells.items(), strict=False):
        _draw_body(axes, body, methods)
    handles, labels = [], []
    for method in result.config.methods:
        colour, style = _style(method)
        (line,) = grid[-1].plot([], [], style, color=colour, ms=4)
        order = result.orders[method]
        slope = f"  (order {order.slope:.1f})" if order is not None else ""
        handles.append(line)
        labels.append(method.replace("_", " ", 1) + slope)
    for axes in grid[len(cells) :]:
        axes.axis("off")
    grid[len(cells)].legend(handles, labels, loc="center", frameon=False, fontsize=8.5)
    return figure


def _draw_body(axes: Axes, body: str, methods: Mapping[str, Mapping[float, Cell]]) -> None:
    for method, steps in methods.items():
        colour, style = _style(method)
        good = [(cell.cost_ratio, cell.error) for cell in steps.values() if cell.error < 1.0]
        if good:
            costs, errors = zip(*good, strict=True)
            axes.loglog(costs, errors, style, color=colour, ms=4, lw=1.2)
    axes.axvline(1.0, color="0.8", lw=1, zorder=0)
    axes.set(xlabel="cost / Euler at 1 ms", ylabel="relative position error", ylim=(1e-13, 1.0))
    axes.set_title(body.replace("_", " "))
    axes.grid(alpha=0.25)


def _style(method: str) -> tuple[Colour, str]:
    integrator, marks = STYLES.get(method, ("", ".-"))
    return INTEGRATOR_COLOURS.get(integrator, GREY), marks
