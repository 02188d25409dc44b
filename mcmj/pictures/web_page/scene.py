"""What a page shows: a body, its readouts and targets, and how much everything is magnified."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mcmj.core.body import Body
from mcmj.core.integrators import integrator_named
from mcmj.core.options import Options
from mcmj.core.readout import Readout
from mcmj.mjcf.appearance import frame, node_colour, node_kinds
from mcmj.mjcf.write import to_mjcf
from mcmj.pictures.film import deformation_scale, strains
from mcmj.utils.colours import (
    OUTPUT_COLOURS,
    SHORTENED_COLOUR,
    SPRING_COLOUR,
    STRETCHED_COLOUR,
    TARGET_COLOUR,
    Colour,
    in_bytes,
)
from mcmj.utils.validation import Array

PULL = 3.0  # the strongest pull of the mouse, over the largest force that the loop feeds back
DIGITS = 5  # of orbits, which are only drawn


@dataclass(frozen=True)
class ShownReadout:
    """A readout that the page can close the loop by.

    Attributes:
        name: of it.
        readout: its weights and bias.
        positions, velocities: (N, D) where it starts.
        outputs: (T, n_outputs) of trial runs by it.
        orbits: (P, n_outputs) of its target: none, one, or one for every stop of the first input.
    """

    name: str
    readout: Readout
    positions: Array
    velocities: Array
    outputs: Array
    orbits: Sequence[Array] = ()

    @property
    def ranges(self) -> Array:
        """Lowest and highest of every output (n_outputs, 2), the target's included."""
        whole = np.concatenate([self.outputs, *self.orbits])
        return np.stack([whole.min(axis=0), whole.max(axis=0)], axis=1)


@dataclass(frozen=True)
class Check:
    """A closed-loop run of the first readout, for the page to repeat.

    Attributes:
        outputs: (K, n_outputs) at every `every`-th control step, from the start.
        steps: control steps of the run.
        every: steps between the rows of outputs.
        index, force, pushed: of a free node, by its place among them, and the force (D,) [N]
            that pushes it for the first `pushed` steps.
    """

    outputs: Array
    steps: int
    every: int
    index: int
    force: Array
    pushed: int


@dataclass(frozen=True)
class Scene:
    """All that a page shows.

    Attributes:
        title: of the page.
        body: planar, or in space and seen along z.
        options: how it is stepped; an integrator and springs of MuJoCo's own.
        readouts: the first closes the loop at the start.
        stops: the values (K,) that the slider of each input takes; it starts in the middle.
        positions: (T, N, D) of trial runs, from which magnifications are taken.
        check: a run to compare with.
        kick_speed: standard deviation of the nodes' speeds after a kick [m/s].
        deformation: displacements are drawn this many times larger; None: a round factor.
        note: what else the page should say.
    """

    title: str
    body: Body
    options: Options
    readouts: Sequence[ShownReadout]
    stops: Sequence[Array]
    positions: Array
    check: Check
    kick_speed: float
    deformation: float | None = None
    note: str = ""

    @cached_property
    def scale(self) -> float:
        """Displacements are drawn this many times larger."""
        return self.deformation or deformation_scale(self.body, self.positions)

    @property
    def largest_strain(self) -> float:
        """Of any spring in the trials, where colours are full."""
        return float(np.abs(strains(self.body, self.positions)).max())

    @property
    def largest_pull(self) -> float:
        """Of the mouse [N]."""
        outputs = np.concatenate([readout.outputs for readout in self.readouts])
        return PULL * float(np.abs(outputs @ self.body.w_fb.T).max())

    @property
    def plain(self) -> dict[str, object]:
        """As JSON types, for the page. Free nodes in their order are MuJoCo's bodies and joints."""
        body, options = self.body, self.options
        return {
            "xml": to_mjcf(body, timestep=options.physics_step, integrator=options.integrator),
            "timestep": options.timestep,
            "substeps": options.substeps,
            "delay": options.feedback_delay,
            "stages": integrator_named(options.integrator).stages,
            "dimensions": body.dimensions,
            "rest": body.positions,
            "free": body.free,
            "springs": body.springs,
            "restLengths": body.rest_lengths,
            "stops": self.stops,
            "nOutputs": body.n_outputs,
            "readouts": [self._plain_readout(readout) for readout in self.readouts],
            "frame": frame(body),
            "scale": self.scale,
            "largestStrain": self.largest_strain,
            "largestPull": self.largest_pull,
            "kickSpeed": self.kick_speed,
            "colours": self._colours(),
            "check": vars(self.check),
        }

    def _plain_readout(self, readout: ShownReadout) -> dict[str, object]:
        """Weights (n_outputs, L) and bias; the start as MuJoCo's qpos and qvel."""
        body, free = self.body, self.body.free
        return {
            "name": readout.name,
            "weights": readout.readout.weights.T,
            "bias": readout.readout.bias,
            "qpos": (readout.positions - body.positions)[free].ravel(),
            "qvel": readout.velocities[free].ravel(),
            "ranges": readout.ranges,
            "orbits": [_rounded(orbit) for orbit in readout.orbits],
        }

    def _colours(self) -> dict[str, object]:
        return {
            "nodes": [_css(node_colour(self.body, node)) for node in range(self.body.n_nodes)],
            "kinds": {name: _css(colour) for name, colour in node_kinds(self.body).items()},
            "spring": in_bytes(SPRING_COLOUR),
            "stretched": in_bytes(STRETCHED_COLOUR),
            "shortened": in_bytes(SHORTENED_COLOUR),
            "target": _css(TARGET_COLOUR),
            "outputs": [_css(colour) for colour in OUTPUT_COLOURS],
        }


def _rounded(orbit: Array) -> list[list[float]]:
    return [[float(f"{value:.{DIGITS}g}") for value in point] for point in orbit]


def _css(colour: Colour) -> str:
    return "rgb({} {} {})".format(*in_bytes(colour))
