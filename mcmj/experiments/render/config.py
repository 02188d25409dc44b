"""What a film shows: its Config."""

from dataclasses import dataclass, field
from pathlib import Path

from mcmj.learning.lessons import Teaching
from mcmj.pictures.rendering import Style
from mcmj.targets.named import named_target
from mcmj.utils.validation import require_count, require_duration, require_name, require_number

FORMATS = ("mp4", "gif", "png")


@dataclass(frozen=True)
class Config:
    """What to show.

    Attributes:
        body: a body file, or the name of a body that comes with mcmj; it is stepped as the
            file says.
        trajectory: a trajectory file (.npz or .zarr) with a body and positions, shown instead
            of a run.
        readout: name of a readout in the body file; default: that of the task, else its active
            one; a body without any is taught the task.
        task: van_der_pol, .., a gait, a .csv file or package.module:function: drawn in red, on
            which the run starts, and what a body without readout is taught; default: the
            readout's name if it is a target, else none (such a run starts at rest), or
            van_der_pol for a body without readout.
        seed: of noise and random forces.
        duration: of the run, if nothing disturbs it [s].
        freeze: outputs (1, 2, ..) that are held at their value while the body is disturbed.
        forces: constant random forces on all nodes up to this [N] while it is disturbed.
        length_noise: white noise on all lengths [m], standard deviation, while it is disturbed.
        kick: random speed given to all nodes as the disturbance begins [m/s].
        before, during, after: the disturbance, and the free runs around it [s].
        from_rest: start at total rest instead of on the target.
        deformation: displacements are drawn this many times larger; default: a round factor
            that makes them visible.
        formats: any of mp4, gif, png.
        stills: number of PNG pictures.
        style: frames a second, speed, renderer.
    """

    body: str = "quadratic"
    trajectory: Path | None = None
    readout: str | None = None
    task: str | None = None
    seed: int = 0
    duration: float = 15.0
    freeze: tuple[int, ...] = ()
    forces: float = 0.0
    length_noise: float = 0.0
    kick: float = 0.0
    before: float = 5.0
    during: float = 5.0
    after: float = 15.0
    from_rest: bool = False
    deformation: float | None = None
    formats: tuple[str, ...] = FORMATS
    stills: int = 3
    style: Style = field(default_factory=Style)

    def __post_init__(self) -> None:
        for name in ("duration", "before", "during", "after"):
            require_duration(name, getattr(self, name))
        for name in ("forces", "length_noise", "kick"):
            require_number(name, getattr(self, name), 0.0)
        for output in self.freeze:
            require_count("freeze", output, 1)
        require_count("stills", self.stills, 1)
        require_name("format", FORMATS, *self.formats)
        if self.task is not None:
            named_target(self.task)

    @property
    def disturbance(self) -> str:
        """What disturbs the body, in words; empty if nothing does."""
        words = [f"output x{output} frozen" for output in self.freeze]
        words += [f"random forces up to {self.forces:g} N"] * (self.forces > 0)
        words += [f"length noise {self.length_noise:g} m"] * (self.length_noise > 0)
        words += [f"kicked at {self.kick:g} m/s"] * (self.kick > 0)
        return ", ".join(words)


def total_milliseconds(config: Config) -> int:
    """Run at most, teaching included, and drawn: for a progress bar."""
    run = config.before + config.during + config.after + Teaching().total
    return round(1e3 * (run + config.duration))
