"""Feedback linearisability, and why an array needs diversity (Hauser et al. 2012, app. B, D, E).

The conditions LI and INV by symbols (analysis.lie_brackets); the controllability matrix of
arrays of linear springs as their stiffnesses become equal; and the same arrays in MuJoCo as a
fading memory: a linear readout of the lengths filters the input with a Gaussian kernel of the past.
Equal springs all say the same, and one spring is no memory to choose from.
"""

from dataclasses import dataclass

import numpy as np

from mcmj.analysis import lie_brackets
from mcmj.analysis.lie_brackets import Linearisability
from mcmj.analysis.spring_arrays import diverse_array, numerical_rank
from mcmj.learning.regression import fit_readout
from mcmj.metrics import orbits
from mcmj.simulation.simulation import Simulation
from mcmj.targets.filter_tasks import gaussian_kernel, smooth_noise
from mcmj.utils.progress import OnSteps
from mcmj.utils.seeds import stream
from mcmj.utils.validation import (
    Array,
    require_count,
    require_duration,
    require_number,
    require_timestep,
)

PUSH = 100.0  # N per unit input


@dataclass(frozen=True)
class Config:
    """What to examine.

    Attributes:
        sizes: numbers of springs of the arrays whose controllability is examined.
        diversities: stiffnesses are spread over stiffness x exp(+-diversity); 0 is added.
        stiffness: middle of the array [N/m]; masses are 1 kg.
        damping: of every spring [N s/m].
        memory_sizes: numbers of springs of the arrays that filter.
        train, washout, test: lengths of the parts of the runs [s].
        timestep: [s].
        length_noise: standard deviation of white noise on the lengths that the readout sees,
            over that of their own motion. Without it, differences of 1e-11 m would still serve.
        symbolic_masses: arrays of up to so many masses are examined symbolically.
        seed: of the input.
    """

    sizes: tuple[int, ...] = (2, 3, 4, 6, 10)
    diversities: tuple[float, ...] = (2.0, 1.0, 0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3, 1e-4, 1e-5)
    stiffness: float = 150.0
    damping: float = 8.0
    memory_sizes: tuple[int, ...] = (2, 4, 20)
    train: float = 40.0
    washout: float = 5.0
    test: float = 20.0
    timestep: float = 1e-3
    length_noise: float = 1e-4
    symbolic_masses: int = 3
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("sizes", "memory_sizes"):
            for n in getattr(self, name):
                require_count(name, n, 1)
        for value in self.diversities:
            require_number("diversities", value, 0.0, 10.0, open_low=True)
        require_timestep("timestep", self.timestep)
        for name in ("train", "washout", "test"):
            require_duration(name, getattr(self, name), self.timestep)
        require_number("length_noise", self.length_noise, 0.0)
        require_count("symbolic_masses", self.symbolic_masses, 1)

    @property
    def spreads(self) -> tuple[float, ...]:
        """The diversities, and none."""
        return (*self.diversities, 0.0)


@dataclass(frozen=True)
class Result:
    """What was found; lists go along `config.spreads`.

    Attributes:
        reports: of the symbolic examination.
        conditions, ranks: [springs] of R.
        errors: [springs] nrmse_std of the filter on held-out data.
        baseline: nrmse_std of linear regression on the input of the moment.
    """

    config: Config
    reports: tuple[Linearisability, ...]
    conditions: dict[int, list[float]]
    ranks: dict[int, list[int]]
    errors: dict[int, list[float]]
    baseline: float

    @property
    def metrics(self) -> dict[str, object]:
        """As written to metrics.json."""
        return {
            "linearisability": {
                r.system.name: {
                    "order": r.system.order, "rank": r.rank, "li": r.li, "inv": r.inv,
                    "linearisable": r.linearisable,
                }
                for r in self.reports
            },
            "diversity": self.config.spreads,
            "controllability": {
                str(n): {"rank": self.ranks[n], "condition_number": self.conditions[n]}
                for n in self.ranks
            },
            "fading_memory": {
                "baseline_nrmse_std": self.baseline,
                "nrmse_std": {str(n): errors for n, errors in self.errors.items()},
            },
        }  # fmt: skip


def run(config: Config, *, on_steps: OnSteps = lambda steps: None) -> Result:
    """Examine springs and arrays, then run the arrays as filters."""
    matrices = {
        n: [
            diverse_array(n, s, stiffness=config.stiffness, damping=config.damping)
            .controllability()
            for s in config.spreads
        ]
        for n in config.sizes
    }  # fmt: skip
    inputs, wanted = _task(config)
    errors: dict[int, list[float]] = {}
    for n in config.memory_sizes:
        errors[n] = []
        for spread in config.spreads:
            errors[n].append(_filter_error(config, n, spread, inputs, wanted))
            on_steps(1)
    return Result(
        config,
        reports(config.symbolic_masses),
        {n: [float(np.linalg.cond(r)) for r in rs] for n, rs in matrices.items()},
        {n: [numerical_rank(r) for r in rs] for n, rs in matrices.items()},
        errors,
        _held_out_error(config, inputs, wanted),
    )


def reports(masses: int) -> tuple[Linearisability, ...]:
    """Of a nonlinear spring, of arrays of linear ones, of equal ones, of nonlinear ones."""
    systems = [
        lie_brackets.nonlinear_spring(),
        *map(lie_brackets.linear_array, range(2, masses + 1)),
    ]
    if masses > 1:
        systems += [lie_brackets.equal_array(2), lie_brackets.nonlinear_array(2)]
    return tuple(lie_brackets.check(system) for system in systems)


def _task(config: Config) -> tuple[Array, Array]:
    """Input (T, 1) and its filtered past (T, 1)."""
    steps = round((config.washout + config.train + config.test) / config.timestep)
    inputs = smooth_noise(stream(config.seed, "task_inputs"), steps, config.timestep)
    kernel = gaussian_kernel(config.timestep)
    return inputs, np.convolve(inputs[:, 0], kernel)[:steps, None]


def total_arrays(config: Config) -> int:
    """Arrays that filter, for a progress bar."""
    return len(config.memory_sizes) * len(config.spreads)


def _filter_error(config: Config, n: int, spread: float, inputs: Array, wanted: Array) -> float:
    array = diverse_array(n, spread, stiffness=config.stiffness, damping=config.damping)
    body = array.body()
    sim = Simulation(body, timestep=config.timestep)
    lengths = sim.rollout(inputs=PUSH * inputs, record=("lengths",)).get("lengths")
    noise = stream(config.seed, "length_noise").standard_normal(lengths.shape)
    seen = lengths - body.rest_lengths + config.length_noise * lengths.std(axis=0) * noise
    return _held_out_error(config, seen, wanted)


def _held_out_error(config: Config, seen: Array, wanted: Array) -> float:
    """nrmse_std on the last part, of a readout fitted to the part before it."""
    first, last = (
        round(t / config.timestep) for t in (config.washout, config.washout + config.train)
    )
    w_out = fit_readout(seen[first:last], wanted[first:last])
    return orbits.nrmse_std(seen[last:] @ w_out, wanted[last:])
