"""What a video shows: the motion of a body or a model, its outputs, and what happens when."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np
import numpy.typing as npt

from mcmj.core.body import Body, spring_lengths
from mcmj.mjcf.appearance import frame
from mcmj.utils.colours import strain_colours
from mcmj.utils.errors import InvalidArgumentError, UnknownNameError
from mcmj.utils.validation import Array, as_array, require_number

SHOWN_SHARE = 0.05  # the automatic scale makes the largest displacement this share of the body
ARROW_SHARE = 0.12  # length of the longest arrow, as a share of the body


@dataclass(frozen=True)
class Window:
    """A stretch of time [s] that is marked, and what happens in it."""

    start: float
    end: float
    label: str


class Recording:
    """Outputs at T >= 2 equally spaced times: what films of bodies and of models have in common."""

    times: Array
    outputs: Array
    orbit: Array | None
    windows: Sequence[Window]

    @property
    def timestep(self) -> float:
        """Between two samples [s]."""
        return float(self.times[1] - self.times[0])

    @property
    def scales(self) -> str:
        """How much the picture is magnified, in words."""
        return ""

    def label(self, index: int) -> str:
        """What happens at a time, from the windows around it."""
        now = self.times[index]
        return ", ".join(w.label for w in self.windows if w.start <= now < w.end)

    def pick(self, fps: float, speed: float) -> npt.NDArray[np.int64]:
        """Indices of the samples shown by a video of so many frames a second.

        Args:
            speed: 1 for real time, 2 for twice as fast.
        """
        require_number("fps", fps, 0.0, open_low=True)
        require_number("speed", speed, 0.0, open_low=True)
        stride = speed / (fps * self.timestep)
        at = np.arange(int((len(self.times) - 1) / stride + 1e-9) + 1) * stride
        return np.minimum(at.round().astype(np.int64), len(self.times) - 1)

    def _check(self) -> None:
        n = len(self.times)
        if n < 2:
            raise InvalidArgumentError("times", "at least two steps", n)
        as_array("times", self.times, (n,))
        as_array("outputs", self.outputs, (n, None))
        if self.orbit is not None:
            as_array("orbit", self.orbit, (None, self.outputs.shape[1]))


@dataclass(frozen=True)
class ModelFilm(Recording):
    """T steps of any MuJoCo model, T >= 2, equally spaced.

    Attributes:
        model: as compiled.
        times: (T,) [s].
        qpos: (T, nq).
        outputs: (T, n_outputs); with none there is no phase portrait.
        orbit: (P, n_outputs) of the target, drawn in red; None: no target.
        windows: stretches of time that are marked.
        camera: name of one of the model's; None: one that follows its first moving body.

    Raises:
        InvalidArgumentError, UnknownNameError: wrong shapes, NaN, fewer than two steps, or no
            such camera.
    """

    model: mujoco.MjModel
    times: Array
    qpos: Array
    outputs: Array
    orbit: Array | None = None
    windows: Sequence[Window] = ()
    camera: str | None = None

    def __post_init__(self) -> None:
        self._check()
        as_array("qpos", self.qpos, (len(self.times), self.model.nq))
        cameras = [self.model.camera(i).name for i in range(self.model.ncam)]
        if self.camera is not None and self.camera not in cameras:
            raise UnknownNameError("camera", self.camera, cameras)


@dataclass(frozen=True)
class Film(Recording):
    """T control steps of one body, T >= 2, equally spaced.

    Attributes:
        times: (T,) [s].
        positions: (T, N, D) [m].
        outputs: (T, n_outputs); with none there is no phase portrait.
        forces: (T, N) forces on the nodes along the body's direction [N], drawn as arrows; None:
            no arrows.
        orbit: (P, n_outputs) of the target, drawn in red; None: no target.
        windows: stretches of time that are marked.
        deformation: displacements are drawn this many times larger; None: a round factor that
            makes them visible.

    Raises:
        InvalidArgumentError: wrong shapes, NaN, or fewer than two steps.
    """

    body: Body
    times: Array
    positions: Array
    outputs: Array
    forces: Array | None = None
    orbit: Array | None = None
    windows: Sequence[Window] = ()
    deformation: float | None = None

    def __post_init__(self) -> None:
        self._check()
        n, n_nodes = len(self.times), self.body.n_nodes
        as_array("positions", self.positions, (n, n_nodes, self.body.dimensions))
        as_array("outputs", self.outputs, (n, self.body.n_outputs))
        if self.forces is not None:
            as_array("forces", self.forces, (n, n_nodes))
        if self.deformation is not None:
            require_number("deformation", self.deformation, 0.0, open_low=True)

    @property
    def scales(self) -> str:
        """Of deformation and arrows, in words."""
        words = f", deformation x {self.scale:g}"
        if self.largest_force > 0.0:
            words += f", longest arrow {self.largest_force:.2g} N"
        return words

    @cached_property
    def scale(self) -> float:
        """Displacements are drawn this many times larger."""
        return self.deformation or deformation_scale(self.body, self.positions)

    @cached_property
    def largest_force(self) -> float:
        """Of any node at any time [N]: the longest arrow; 0 without arrows."""
        return 0.0 if self.forces is None else float(np.abs(self.forces).max())

    @cached_property
    def largest_strain(self) -> float:
        """Of any spring at any time: (l - l0) / l0, where colours are full; 0 at rest."""
        largest = 0.0
        for chunk in np.array_split(self.positions, max(1, len(self.positions) // 1000)):
            largest = max(largest, float(np.abs(strains(self.body, chunk)).max(initial=0.0)))
        return largest

    def drawn_positions(self, index: int) -> Array:
        """Node positions (N, D) [m] as drawn, displacements magnified."""
        rest = self.body.positions
        found: Array = rest + self.scale * (self.positions[index] - rest)
        return found

    def colours(self, index: int) -> Array:
        """Of the springs by their strains (L, 3)."""
        return strain_colours(strains(self.body, self.positions[index]), self.largest_strain)

    def arrows(self, index: int) -> Array:
        """Lengths (N,) [m] of the arrows as drawn, positive along the body's direction."""
        if self.forces is None or self.largest_force == 0.0:
            return np.zeros(self.body.n_nodes)
        longest = ARROW_SHARE * max(frame(self.body)[2:])
        found: Array = longest * self.forces[index] / self.largest_force
        return found


def strains(body: Body, positions: Array) -> Array:
    """(l - l0) / l0 (..., L) of the springs with the nodes at positions (..., N, D)."""
    return spring_lengths(positions, body.springs) / body.rest_lengths - 1.0


def deformation_scale(body: Body, positions: Array) -> float:
    """A round factor (1, 2, 5, 10, ..) that makes displacements (T, N, D) visible."""
    largest = np.abs(positions - body.positions).max()
    if largest == 0.0:
        return 1.0
    wanted = SHOWN_SHARE * max(frame(body)[2:]) / largest
    exponent = np.floor(np.log10(wanted))
    mantissa = max(m for m in (1, 2, 5) if m <= wanted / 10**exponent + 1e-9)
    return max(1.0, float(mantissa * 10**exponent))
