"""Copies of a reservoir in MuJoCo, placed at states of a chart."""

import numpy as np

from mcmj.analysis.loops.chart import Chart
from mcmj.core.integrators import integrator_named
from mcmj.simulation.reservoir import Reservoir
from mcmj.simulation.simulation import Simulation
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, require_count

KEPT = 8  # sets of copies that are not made anew


class PlacedCopies:
    """Copies of a reservoir, started at any states of its model.

    Args:
        reservoir: without copies; its positions now are the chart's reference.
        threads: results do not depend on them.

    Raises:
        InvalidArgumentError: its state is more than positions, velocities and activations.
    """

    def __init__(self, reservoir: Reservoir, threads: int = 1) -> None:
        require_count("threads", threads, 1)
        check_memoryless(reservoir)
        self.reservoir, self.threads = reservoir, threads
        self.chart = Chart(reservoir.model, reservoir.qpos)
        self._sets: dict[int, Reservoir] = {}

    @property
    def now(self) -> Array:
        """(n,): where the reservoir is."""
        one = self.reservoir
        found = self.chart.coordinates(one.qpos[None], one.qvel[None], one.act[None])
        return np.asarray(found[0])

    def at(self, z: Array, w_out: Array | None) -> Reservoir:
        """Copies that start at states (B, n) with a readout; those that blow up are left behind."""
        count = len(z)
        if count not in self._sets:
            if len(self._sets) == KEPT:
                del self._sets[next(iter(self._sets))]
            self._sets[count] = self.reservoir.with_copies(count, self.threads, lenient=True)
        copies = self._sets[count]
        copies.set_readout(w_out)
        copies.restart(*self.chart.state(z))
        return copies

    def coordinates(self, copies: Reservoir) -> Array:
        """States (B, n) of copies."""
        with np.errstate(all="ignore"):  # what blew up
            return self.chart.coordinates(copies.qpos, copies.qvel, copies.act)


def check_memoryless(reservoir: Reservoir) -> None:
    """Raise unless a state is positions, velocities and activations, and nothing else.

    Raises:
        InvalidArgumentError: delayed feedback, sensors heard late, the leapfrog, substeps, or a
            model with delays or plugins of its own; also a reservoir with copies, or the twin.
    """
    engine = reservoir.in_mujoco
    model, late = engine.model, np.flatnonzero(engine.channels.late)
    if reservoir.feedback_delay:
        raise InvalidArgumentError("feedback_delay", "0, without memory", reservoir.feedback_delay)
    if late.size:
        names = ", ".join(reservoir.signal_names[i] for i in late)
        wanted = "those that MuJoCo computes before actuation; others are heard a step late"
        raise InvalidArgumentError("sensors", wanted, names)
    if isinstance(reservoir, Simulation):
        options = reservoir.options
        if integrator_named(options.integrator).by_callback:
            wanted = "one of MuJoCo's own, without memory, as 'Euler'"
            raise InvalidArgumentError("integrator", wanted, repr(options.integrator))
        if options.substeps > 1:
            raise InvalidArgumentError("substeps", "1: sensors hold otherwise", options.substeps)
    if model.nhistory or model.npluginstate:
        kind = "delayed sensors or actuators" if model.nhistory else "plugins with a state"
        raise InvalidArgumentError("model", "one without memory", kind)
