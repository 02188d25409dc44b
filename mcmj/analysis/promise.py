"""What can be measured of a body before it is taught: does any of it tell whether it will learn?

Of the linearised body at rest, M v' = -K q - D v, with eigenvalues s and, from a unit feedback
force to the lengths, the transfer function H(s) = J (M s^2 + D s + K)^-1 B:

    slowest             log10 of the longest time constant, in periods of the target
    diversity           standard deviation of log10 of the time constants 1 / |Re s|
    oscillating         share of the modes that oscillate
    nearest             smallest |log(|s| T / 2 pi)|: how near a mode is to the target's frequency
    gain                log10 of |H| at the target's frequency [m/N]
    dimension           (sum v)^2 / sum v^2, v the squared singular values of the responses to the
                        target's first harmonics: in how many directions the lengths answer
    weight              log10 of the root mean square of all feedback weights [N]

and of the body itself, under random symbols, the measures of mcmj.analysis.capacities.
"""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
from scipy.linalg import eigvals

from mcmj.analysis.capacities import Probe, capacities_of
from mcmj.core.body import Body
from mcmj.simulation.simulation import Simulation
from mcmj.simulation.stepsize.linearisation import linear_system
from mcmj.targets.limit_cycles import Target
from mcmj.utils.validation import Array

HARMONICS = 8
PROBE = Probe(
    symbols=600, washout=50, max_delays=(20, 8), streams=40, stream_symbols=20, strength=1.0
)


def promise(body: Body, target: Target, seed: int = 0) -> dict[str, float]:
    """The measures of a body, by name.

    Args:
        seed: of the symbols.

    Raises:
        DivergenceError: the body blew up under the symbols.
    """
    return linear_measures(body, target.period) | _worth(body, seed)


def linear_measures(body: Body, period: float) -> dict[str, float]:
    """Those of the linearised body, for a target with this period [s]."""
    masses, k, d = _matrices(body)
    n, omega = len(masses), 2.0 * np.pi / period
    lower = np.hstack([-k / masses[:, None], -d / masses[:, None]])
    modes = eigvals(np.vstack([np.eye(n, 2 * n, n), lower]))
    times = np.log10(1.0 / np.maximum(np.abs(modes.real), 1e-12))
    answers = [response(body, 1j * omega * m) for m in range(1, HARMONICS + 1)]
    values = np.linalg.svd(np.hstack([np.hstack([a.real, a.imag]) for a in answers]))[1] ** 2
    return {
        "slowest": float(times.max() - np.log10(period)),
        "diversity": float(times.std()),
        "oscillating": float((np.abs(modes.imag) > 1e-9).mean()),
        "nearest": float(np.abs(np.log(np.abs(modes) / omega)).min()),
        "gain": float(np.log10(np.linalg.norm(answers[0]))),
        "dimension": float(values.sum() ** 2 / (values**2).sum()),
        "weight": float(np.log10(np.sqrt((body.w_fb**2).mean()))),
    }


def response(body: Body, s: complex) -> npt.NDArray[np.complex128]:
    """H(s): lengths (L, n_outputs) per unit of each fed-back output, small motions [m]."""
    masses, k, d = _matrices(body)
    push = np.einsum("nc,a->nac", body.w_fb, body.direction)[body.free].reshape(len(masses), -1)
    moved = np.zeros((body.n_nodes, body.dimensions, body.n_outputs), dtype=complex)
    answer = np.linalg.solve(np.diag(masses) * s**2 + d * s + k, push)
    moved[body.free] = answer.reshape(len(body.free), body.dimensions, -1)
    gap = body.positions[body.springs[:, 1]] - body.positions[body.springs[:, 0]]
    axis = gap / np.linalg.norm(gap, axis=1)[:, None]
    apart = moved[body.springs[:, 1]] - moved[body.springs[:, 0]]
    found: npt.NDArray[np.complex128] = np.einsum("la,lac->lc", axis, apart)
    return found


def _matrices(body: Body) -> tuple[Array, Array, Array]:
    """M (n,), K and D (n, n) of small motions about the start."""
    system = linear_system(body)
    return system.masses, system.stiffness.toarray(), system.damping.toarray()


def _worth(body: Body, seed: int) -> dict[str, float]:
    return capacities_of(Simulation(body, engine="twin"), replace(PROBE, seed=seed)).measures
