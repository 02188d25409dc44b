"""How far a trained body is from failing, in six panels."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mcmj.analysis.stability.basin import Survey
from mcmj.analysis.stability.floquet import Complex
from mcmj.analysis.stability.tolerance import Tolerance
from mcmj.experiments.certify.result import Result
from mcmj.pictures.plotting import TITLES, draw_orbit, draw_phase_plane, new_figure
from mcmj.utils.colours import BLUE, ORANGE, TARGET_COLOUR


def figures(result: Result) -> dict[str, Figure]:
    """By file name."""
    return {"certificate": certificate_figure(result)}


def certificate_figure(result: Result) -> Figure:
    """Orbit, multipliers and starts; below them blows and tolerances."""
    target, config = result.target, result.config
    figure = new_figure(11.0, 7.2)
    figure.suptitle(f"Certificate: {TITLES.get(target.name, target.name)}")
    (orbit, multipliers, starts), (kicks, pushes, tolerances) = figure.subplots(2, 3)
    draw_phase_plane(orbit, result.outputs, target)
    orbit.set_title("free run; red: target")
    _draw_multipliers(multipliers, result.floquet.multipliers, result.target_multipliers)
    _draw_starts(starts, result)
    _draw_blows(kicks, "kick [RMS speed of the nodes]", config.kicks, result.kicks)
    _draw_blows(pushes, "random forces for 1 s [N]", config.pushes, result.pushes)
    kicks.set_ylabel("share of the copies")
    kicks.legend(frameon=False, loc="center left")
    _draw_tolerances(
        tolerances,
        {
            "noise on lengths [m]": result.noise,
            "forces [N]": result.force_fine,
            "forces, own step [N]": result.force,
        },
    )
    return figure


def _draw_multipliers(axes: Axes, body: Complex, target: Complex | None) -> None:
    circle = np.exp(1j * np.linspace(0, 2 * np.pi, 200))
    axes.plot(circle.real, circle.imag, color="0.6", lw=1)
    axes.plot(body.real, body.imag, "o", ms=5, color=BLUE, mec="black", mew=0.4, label="body")
    if target is not None:
        axes.plot(
            target.real, target.imag, "x", ms=9, mew=2, color=TARGET_COLOUR, label="target's system"
        )
    axes.set(aspect="equal", xlabel="real part", ylabel="imaginary part")
    axes.set_title(f"Floquet multipliers, the second {abs(body[1]):.3f}")
    axes.legend(loc="center", bbox_to_anchor=(0.5, 0.28))


def _draw_starts(axes: Axes, result: Result) -> None:
    first, times = result.start_outputs, result.starts.times
    draw_orbit(axes, result.target)
    good, known = np.isfinite(times), np.isfinite(first).all(axis=1)
    points = axes.scatter(
        first[good, 0], first[good, 1], c=times[good], s=16, cmap="viridis", zorder=3
    )
    axes.figure.colorbar(points, ax=axes, label="recovery time [s]", shrink=0.9)
    axes.plot(*first[~good & known, :2].T, "x", color="black", ms=5, zorder=4)
    axes.set(xlabel="first $x_1$", ylabel="first $x_2$")
    axes.set_title(f"starts: {int(good.sum())} of {len(good)} come to the orbit")


def _draw_blows(axes: Axes, label: str, strengths: Sequence[float], survey: Survey) -> None:
    good, blown = (
        kind.reshape(len(strengths), -1).mean(axis=1) for kind in (survey.recovered, survey.blown)
    )
    axes.semilogx(strengths, good, "o-", color=BLUE, label="come back")
    axes.semilogx(strengths, blown, "s--", color=ORANGE, ms=4, label="blow up")
    axes.set(xlabel=label, ylim=(-0.05, 1.05))
    axes.grid(alpha=0.3)


def _draw_tolerances(axes: Axes, tolerances: Mapping[str, Tolerance]) -> None:
    axes.set_xscale("log")
    for row, (label, one) in enumerate(tolerances.items()):
        median, (low, high) = one.median, one.interval
        line = axes.ecdf(one.values, complementary=True, label=label)
        if np.isfinite(high):
            bar, y = [[median - low], [high - median]], 0.5 + 0.04 * (row - 1)
            axes.errorbar(median, y, xerr=bar, fmt="o", ms=4, capsize=3, color=line.get_color())
    axes.set(xlabel="strength for 10 s", ylabel="share that comes back")
    axes.set(yticks=np.linspace(0, 1, 6), ylim=(-0.05, 1.5))  # room for the legend
    axes.set_title("tolerances: medians, 95 % intervals")
    axes.legend(fontsize=8, loc="upper center")
    axes.grid(alpha=0.3)
