"""What a body is worth as a computer: capacities and ranks, each with its source.

All of them look at states x_k (K, N), here spring lengths, under inputs u_k that are
independent and uniform in [-1, 1], and ask what a linear readout with a bias can make of them.
The capacity for a target z is C = 1 - min MSE / var(z), in [0, 1]. A state of N independent
components has a total capacity, over all orthogonal targets, of at most N (Dambre et al. 2012).

On K samples even a target that has nothing to do with the state has a capacity: K C is then
distributed as chi-square with N degrees of freedom. Capacities that this explains with a
probability above `p_value` count as 0.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement, groupby, islice

import numpy as np
from scipy.linalg import svd
from scipy.special import chdtri, eval_legendre

from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, as_array, require_count, require_number

P_VALUE = 1e-4
BLOCK = 256  # targets at a time

Term = tuple[tuple[int, int], ...]  # (delay, degree), ...


@dataclass(frozen=True)
class Capacities:
    """Capacities of one state for many targets.

    Attributes:
        terms: what each target is: ((delay, degree), ...), a product of Legendre polynomials.
        values: (n,) capacities above the threshold, else 0.
        threshold: a capacity that chance exceeds with the p-value.
        rank: number of independent components of the state, the bound on the total.
    """

    terms: tuple[Term, ...]
    values: Array
    threshold: float
    rank: int

    @property
    def total(self) -> float:
        """Sum of all capacities."""
        return float(self.values.sum())

    @property
    def memory(self) -> float:
        """Linear memory of the inputs before the last one (Jaeger 2002)."""
        return self.of_degree(1) - self.of(((0, 1),))

    def of_degree(self, degree: int) -> float:
        """Sum of the capacities of one total degree; 1 is linear memory."""
        return float(self.by_delay(degree).sum())

    def by_delay(self, degree: int) -> Array:
        """Capacities of one total degree, summed by the delay of the oldest input, 0, 1, ..."""
        chosen = [i for i, term in enumerate(self.terms) if sum(d for _, d in term) == degree]
        oldest = [max(delay for delay, _ in self.terms[i]) for i in chosen]
        return np.bincount(oldest, self.values[chosen]).astype(np.float64)

    def of(self, term: Term) -> float:
        """The capacity for one target, such as ((3, 1),) for u_(k-3).

        Raises:
            InvalidArgumentError: it was not among the targets.
        """
        if term not in self.terms:
            raise InvalidArgumentError("term", "one of the targets", term)
        return float(self.values[self.terms.index(term)])


def memory_capacity(states: Array, inputs: Array, max_delay: int) -> Capacities:
    """Linear memory: the capacities for u_(k-i), i = 0 .. max_delay.

        MC = sum_i cov(u_(k-i), y_k)^2 / (var u var y)   (Jaeger, GMD report 152, 2002, leaves
                                                          out i = 0: `memory`)

    Args:
        states: (K, N).
        inputs: (K,) in [-1, 1], u_k what x_k has just seen.

    Raises:
        InvalidArgumentError: wrong shapes, inputs beyond [-1, 1], or too few samples.
    """
    return processing_capacity(states, inputs, [max_delay])


def processing_capacity(
    states: Array, inputs: Array, max_delays: Sequence[int], *, p_value: float = P_VALUE
) -> Capacities:
    """Information processing capacity (Dambre, Verstraeten, Schrauwen, Massar, Sci. Rep. 2012).

    Targets are all products of Legendre polynomials prod_i P_(d_i)(u_(k-i)) of total degree
    d = 1, 2, ..., which are orthogonal for uniform inputs.

    Args:
        states, inputs: as for `memory_capacity`.
        p_value: see the module's text.
        max_delays: the largest delay looked at, for degree 1, 2, ...

    Raises:
        InvalidArgumentError: wrong shapes, inputs beyond [-1, 1], or too few samples.
    """
    x = as_array("states", states, (None, None))
    u = as_array("inputs", inputs, (len(x),))
    if np.abs(u).max() > 1.0:
        raise InvalidArgumentError("inputs", "numbers in [-1, 1]", f"{np.abs(u).max():g}")
    require_number("p_value", p_value, 0.0, 1.0, open_low=True)
    for delay in max_delays:
        require_count("max_delays", delay, 0)
    longest = max(max_delays)
    rows = len(x) - longest
    if rows <= 2 * x.shape[1]:
        raise InvalidArgumentError(
            "states", f"more than {2 * x.shape[1] + longest} samples", len(x)
        )
    basis = _orthonormal(x[longest:])
    polynomials = _polynomials(u, longest, len(max_delays))
    terms = tuple(_terms(max_delays))
    waiting = iter(terms)
    values = []
    while block := list(islice(waiting, BLOCK)):
        targets = np.column_stack([_product(polynomials, term) for term in block])
        targets -= targets.mean(axis=0)
        values.append(((basis.T @ targets) ** 2).sum(axis=0) / (targets**2).sum(axis=0))
    rank = basis.shape[1]
    threshold = float(chdtri(rank, p_value) / rows)  # of chi-square
    found = np.concatenate(values)
    return Capacities(terms, np.where(found > threshold, found, 0.0), threshold, rank)


def kernel_rank(states: Array, resolution: float) -> int:
    """Rank of the states (M, N) that M different input streams lead to.

    The kernel quality of Legenstein and Maass (Neural Networks 20, 2007): how many of the
    streams a linear readout can tell apart at will. Counted are the directions along which the
    states differ by more than the readout can see: singular values of the states about their
    mean, over sqrt(M), above the resolution.

    Args:
        resolution: of the readout, in units of the states; > 0.

    Raises:
        InvalidArgumentError: wrong shape, NaN, or a resolution that is not positive.
    """
    x = as_array("states", states, (None, None))
    require_number("resolution", resolution, 0.0, open_low=True)
    values = np.linalg.svd(x - x.mean(axis=0), compute_uv=False)
    return int((values / np.sqrt(len(x)) > resolution).sum())


def generalisation_rank(states: Array, resolution: float) -> int:
    """The same for M streams that should count as equal: here, that end alike.

    Legenstein and Maass (2007): the lower, the better the readout generalises. The difference
    to the kernel rank is the state's worth.

    Args, Raises: as for `kernel_rank`.
    """
    return kernel_rank(states, resolution)


def _orthonormal(states: Array) -> Array:
    """(K, rank): orthonormal basis of the states' columns about their means."""
    centred = states - states.mean(axis=0)
    u, values, _ = svd(centred, full_matrices=False)
    # lengths of 100 m move by 0.1 m or less: what is below their rounding is no information
    rounding = np.finfo(float).eps * np.sqrt(len(states)) * np.abs(states).max()
    found: Array = u[:, values > max(10 * rounding, values[0] * 1e-12)]
    return found


def _polynomials(u: Array, longest: int, degrees: int) -> Array:
    """(delays, degrees + 1, K - longest): P_d(u_(k - delay)) at [delay, d]."""
    table = np.array([eval_legendre(d, u) for d in range(degrees + 1)])
    count = len(u) - longest
    return np.array([table[:, longest - i : longest - i + count] for i in range(longest + 1)])


def _terms(max_delays: Sequence[int]) -> Iterator[Term]:
    """All ((delay, degree), ...) of total degree 1, 2, ... with delays up to the maximum of it."""
    for degree, longest in enumerate(max_delays, start=1):
        for delays in combinations_with_replacement(range(longest + 1), degree):
            yield tuple((delay, len(list(same))) for delay, same in groupby(delays))


def _product(polynomials: Array, term: Term) -> Array:
    found: Array = np.prod([polynomials[delay, degree] for delay, degree in term], axis=0)
    return found
