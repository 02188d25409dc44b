"""The certificate: what was measured of a trained body, as numbers and in words."""

from dataclasses import dataclass

import numpy as np

from mcmj.analysis.stability.basin import Survey
from mcmj.analysis.stability.cycle import Cycle
from mcmj.analysis.stability.floquet import Complex, Floquet
from mcmj.analysis.stability.lyapunov import Exponent
from mcmj.analysis.stability.phase import Diffusion
from mcmj.analysis.stability.tolerance import Tolerance
from mcmj.core.body import Body
from mcmj.experiments.certify.config import Config
from mcmj.targets.limit_cycles import Target
from mcmj.utils.validation import Array


@dataclass(frozen=True)
class Result:
    """The certificate.

    Attributes:
        errors: of the MuJoCo run, by name.
        outputs: (T, n_outputs) of its last window.
        floquet, target: multipliers of the body, and of the system it was taught (or None).
        mujoco_monodromy_error: of the phase's and the leading direction, |D d - M d| / |d|.
        starts, kicks, pushes: surveys of scales x phases, kicks x copies, pushes x copies.
        start_outputs: (B, n_outputs) of the starts' states.
        rest_recovers: whether the loop comes to the orbit from total rest.
        mujoco_agrees: of a sample of pushes: how many MuJoCo judges as the twin does, of how many.
        force, force_fine, noise: tolerances of the copies: at the body's own step, where Euler
            may fail before the body does, and with `refine`; of noise on the lengths.
    """

    config: Config
    body: Body
    target: Target
    cycle: Cycle
    errors: dict[str, float]
    outputs: Array
    floquet: Floquet
    target_multipliers: Complex | None
    mujoco_monodromy_error: float
    exponent: Exponent
    diffusion: Diffusion
    starts: Survey
    start_outputs: Array
    rest_recovers: bool
    kicks: Survey
    pushes: Survey
    mujoco_agrees: tuple[int, int]
    force: Tolerance
    force_fine: Tolerance
    noise: Tolerance

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json; multipliers as [real, imaginary]."""
        wanted = self.target_multipliers
        return {
            **self.errors,
            "period": self.cycle.period,
            "target_period": self.target.period,
            "cycle_residual": self.cycle.residual,
            "floquet_multipliers": _pairs(self.floquet.multipliers),
            "floquet_multipliers_variational": _pairs(self.floquet.variational),
            "floquet_disagreement": self.floquet.disagreement,
            "phase_multiplier_error": abs(self.floquet.multipliers[0] - 1.0),
            "leading_nontrivial": self.floquet.leading_nontrivial,
            "mujoco_monodromy_error": self.mujoco_monodromy_error,
            "target_multipliers": None if wanted is None else _pairs(wanted),
            "target_leading_nontrivial": None if wanted is None else float(abs(wanted[1])),
            "basin_fraction": self.starts.fraction,
            "start_recovery_time": self.starts.median_time,
            "rest_recovers": self.rest_recovers,
            "kick_recovery": self.kicks.table(self.config.kicks),
            "push_recovery": self.pushes.table(self.config.pushes),
            "mujoco_pushes_agreeing": list(self.mujoco_agrees),
            "lyapunov_exponent": self.exponent.value,
            "lyapunov_spread": self.exponent.spread,
            "phase_diffusion": self.diffusion.coefficient,
            "phase_jitter_per_period": self.diffusion.jitter,
            "phase_jitter_standard_error": self.diffusion.jitter_error,
            "phase_diffusion_noise": self.diffusion.noise,
            **_tolerances("force_tolerance", self.force_fine),
            **_tolerances("force_tolerance_own_step", self.force),
            **_tolerances("noise_tolerance", self.noise),
        }


def in_words(result: Result) -> list[tuple[str, str]]:
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
        ("phase jitter per period", _plus_minus(result.diffusion)),
        ("  at noise on lengths", f"{result.diffusion.noise:g} m"),
        ("cycle closes to (RMS, relative)", f"{result.cycle.residual:.1e}"),
        ("from total rest", "recovers" if result.rest_recovers else "does not recover"),
        ("starts that recover", f"{100 * result.starts.fraction:.1f} %"),
        ("  median, longest time", f"{np.median(times):.1f} s, {times.max():.1f} s"
         if times.size else "none"),
        ("median force tolerance", _over_copies(result.force_fine, "N")),
        ("  at the body's own step", _over_copies(result.force, "N")),
        ("median noise tolerance", _over_copies(result.noise, "m")),
        ("pushes judged alike by MuJoCo", f"{agreeing} of {of}"),
    ]  # fmt: skip


def _over_copies(tolerance: Tolerance, unit: str) -> str:
    """A median over copies with its interval."""
    low, high = tolerance.interval
    return f"{tolerance.median:.3g} ({low:.3g} .. {high:.3g}) {unit}"


def _plus_minus(diffusion: Diffusion) -> str:
    """A jitter with its standard error."""
    return f"{diffusion.jitter:.1e} +- {100 * diffusion.jitter_error / diffusion.jitter:.0f} %"


def _tolerances(name: str, tolerance: Tolerance) -> dict[str, object]:
    """The median over the copies, its interval, the weakest copy, and all of them."""
    return {
        name: tolerance.median,
        f"{name}_interval_95": list(tolerance.interval),
        f"{name}_least": tolerance.least,
        f"{name}_by_copy": np.sort(tolerance.values),
    }


def _pairs(values: Complex) -> list[list[float]]:
    return [[float(v.real), float(v.imag)] for v in values]
