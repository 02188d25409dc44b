"""The command: certify."""

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from mcmj.analysis.stability.basin import Survey
from mcmj.analysis.stability.phase import Diffusion
from mcmj.analysis.stability.tolerance import Tolerance
from mcmj.experiments.base import Experiment
from mcmj.experiments.certify.config import Config
from mcmj.experiments.certify.figure import certificate_figure
from mcmj.experiments.certify.run import STAGES, Result, run
from mcmj.utils.progress import progress_bar
from mcmj.utils.validation import Array


def figures(result: Result) -> dict[str, Figure]:
    """The certificate."""
    config = result.config
    figure = certificate_figure(
        result.target,
        result.outputs,
        multipliers=result.floquet.multipliers,
        target_multipliers=result.target_multipliers,
        starts=(result.start_outputs, result.starts.times),
        blows=[
            ("velocity kick [RMS node speed]", *levels(config.kicks, result.kicks)),
            ("random forces for 1 s, F [N]", *levels(config.pushes, result.pushes)),
        ],
        tolerances=[
            (label, one.values, one.median, one.interval)
            for label, one in (
                ("forces [N], own step", result.force),
                ("forces [N], refined steps", result.force_fine),
                ("noise on lengths [m]", result.noise),
            )
        ],
        lines=lines(result),
    )
    return {"certificate": figure}


def levels(strengths: tuple[float, ...], survey: Survey) -> tuple[Array, Array, Array]:
    """Strengths, and the shares that recovered and that blew up."""
    rows = (len(strengths), -1)
    return (
        np.array(strengths),
        survey.recovered.reshape(rows).mean(axis=1),
        survey.blown.reshape(rows).mean(axis=1),
    )


def lines(result: Result) -> list[tuple[str, str]]:
    """The certificate in words and numbers."""
    floquet, wanted = result.floquet, result.target_multipliers
    times = result.starts.times[result.starts.recovered]
    agreeing, of = result.mujoco_agrees
    return [
        ("body", f"{result.body.n_nodes} nodes, {result.body.n_springs} springs"),
        ("orbit error", f"{100 * result.errors['orbit_error']:.3f} %"),
        ("period error", f"{100 * result.errors['period_error']:.4f} %"),
        ("period, target's", f"{result.cycle.period:.5f} s, {result.target.period:.5f} s"),
        ("leading nontrivial multiplier", f"{floquet.leading_nontrivial:.5f}"),
        ("the target system's", "none" if wanted is None else f"{abs(wanted[1]):.2e}"),
        ("phase multiplier - 1", f"{abs(floquet.multipliers[0] - 1):.1e}"),
        ("two methods differ by", f"{floquet.disagreement:.1e}"),
        ("MuJoCo differs by", f"{result.mujoco_monodromy_error:.1e}"),
        ("largest Lyapunov exponent", f"{result.exponent.value:.1e} 1/s"),
        ("phase jitter per period", plus_minus(result.diffusion)),
        ("  at noise on lengths", f"{result.diffusion.noise:g} m"),
        ("cycle closes to (RMS, relative)", f"{result.cycle.residual:.1e}"),
        ("from total rest", "recovers" if result.rest_recovers else "does not recover"),
        ("starts that recover", f"{100 * result.starts.fraction:.1f} %"),
        ("  median, longest time", f"{np.median(times):.1f} s, {times.max():.1f} s"
         if times.size else "none"),
        ("median force tolerance", over_copies(result.force_fine, "N")),
        ("  at the body's own step", over_copies(result.force, "N")),
        ("median noise tolerance", over_copies(result.noise, "m")),
        ("pushes judged alike by MuJoCo", f"{agreeing} of {of}"),
    ]  # fmt: skip


def over_copies(tolerance: Tolerance, unit: str) -> str:
    """A median over copies with its interval."""
    low, high = tolerance.interval
    return f"{tolerance.median:.3g} ({low:.3g} .. {high:.3g}) {unit}"


def plus_minus(diffusion: Diffusion) -> str:
    """A jitter with its standard error."""
    return f"{diffusion.jitter:.1e} +- {100 * diffusion.jitter_error / diffusion.jitter:.0f} %"


def show(result: Result, console: Console) -> None:
    """The result as tables."""
    table = Table("", "", title=f"certificate: {result.target.name}")
    for name, value in lines(result):
        table.add_row(name, value)
    console.print(table)


EXPERIMENT = Experiment(
    name="certify",
    config=Config,
    run=run,
    show=show,
    bar=lambda config, quiet: progress_bar("certifying", len(STAGES), quiet=quiet),
    seed=lambda config: config.noise_seed,
    figures=figures,
)
