"""Which bodies a config asks for: a file's, one that comes with mcmj, or random ones."""

from dataclasses import asdict, dataclass
from typing import Any

from mcmj.core.random_body import BodySettings, draw_body
from mcmj.learning.lessons import Teaching
from mcmj.learning.teaching import teach
from mcmj.mjcf.bundled import StoredBody, open_body
from mcmj.simulation.simulation import Simulation
from mcmj.targets.limit_cycles import TARGETS, target
from mcmj.targets.named import require_outputs
from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import Array, require_count, require_seed


@dataclass(frozen=True)
class BodySource:
    """Bodies by seed.

    Attributes:
        body: a body file, or the name of a body that comes with mcmj; None: drawn, or `default`.
        seed: of the first random body; None: 0, and none is asked for by it.
        seeds: number of bodies; those of consecutive seeds if more than one.
        settings: what a random body is drawn from.
        usual: settings that ask for no random body by themselves.
        default: name of the body that is taken if nothing asks for another; None: a random one.

    Raises:
        InvalidArgumentError: a body beside what only random ones have.
    """

    body: str | None
    seed: int | None
    seeds: int
    settings: BodySettings
    usual: BodySettings
    default: str | None = None

    def __post_init__(self) -> None:
        if self.seed is not None:
            require_seed("seed", self.seed)
        require_count("seeds", self.seeds, 1)
        if self.body is None:
            return
        usual = asdict(self.usual)
        changed = [name for name, value in asdict(self.settings).items() if value != usual[name]]
        if changed:
            wanted = "no settings beside a body, which has its own"
            raise InvalidArgumentError(", ".join(changed), wanted, self.body)
        if self.seeds > 1:
            raise InvalidArgumentError("seeds", "1 beside a body", self.seeds)

    @property
    def first_seed(self) -> int:
        """The seed, or its default."""
        return 0 if self.seed is None else self.seed

    @property
    def all_seeds(self) -> range:
        """One for each body."""
        return range(self.first_seed, self.first_seed + self.seeds)

    def get(self, seed: int) -> StoredBody:
        """The body of a seed, or the one that the file or the name stands for.

        Raises:
            UnknownNameError: no such name.
            BodyFileError: no such file, or not an mcmj body.
        """
        drawn = self.seed is not None or self.seeds > 1 or self.settings != self.usual
        name = self.default if self.body is None and not drawn else self.body
        if name is not None:
            return open_body(name)
        source = {"seed": seed, "settings": asdict(self.settings)}
        return StoredBody(draw_body(seed, self.settings), None, {}, source, {})


def readouts_of(stored: StoredBody, seed: int, **stepping: Any) -> dict[str, Array]:
    """The file's readouts by name; those of the paper's three targets, taught, if it has none.

    Args:
        seed: of teaching.
        stepping: arguments of the Simulation that is taught.

    Raises:
        InvalidArgumentError: there is none, and the body has not the outputs for teaching.
    """
    if stored.readouts:
        return stored.readouts
    if stored.w_out is not None:
        return {"readout": stored.w_out}
    taught = {}
    for name in TARGETS:
        require_outputs(stored.body, target(name))
        simulation = Simulation(stored.body, **stepping)
        taught[name] = teach(simulation, target(name), Teaching(), seed).w_out
    return taught
