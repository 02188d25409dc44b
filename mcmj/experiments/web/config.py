"""What a page shows: its Config."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from mcmj.utils.validation import require_number, require_seed


@dataclass(frozen=True)
class Config:
    """What to show.

    Attributes:
        body: a body file, or the name of a body that comes with mcmj. Without a readout in the
            file it is taught the paper's three targets first.
        readout: name of the readout that runs at the start; default: the first.
        package: MuJoCo's WebAssembly package as a .tgz file; default: fetched by npm once, then
            kept in the cache folder (MCMJ_CACHE_DIR).
        kick_speed: standard deviation of the nodes' speeds after a kick [m/s].
        deformation: displacements are drawn this many times larger; default: a round factor
            that makes them visible.
        seed: of teaching.
        page: name of the page in the folder; `--out NAME.html` says both.
    """

    body: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="BODY")] = "general"
    readout: str | None = None
    package: Path | None = None
    kick_speed: float = 0.5
    deformation: float | None = None
    seed: int = 0
    page: str = "page.html"

    def __post_init__(self) -> None:
        require_seed("seed", self.seed)
        require_number("kick_speed", self.kick_speed, 0.0)
        if self.deformation is not None:
            require_number("deformation", self.deformation, 0.0, open_low=True)
