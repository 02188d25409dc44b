"""What is fitted to a recording: its Config."""

from dataclasses import dataclass

from mcmj.utils.errors import InvalidArgumentError
from mcmj.utils.validation import require_count, require_number


@dataclass(frozen=True)
class Config:
    """What to fit.

    Files are .csv with a header, .npy, or .npz, a row a sample; a first column "time" is the time
    [s], no signal.

    Attributes:
        signals: file of the lengths or other signals, one column each.
        targets: file of what the readout is to say, one column an output, as many rows.
        inputs: file of the input that drove the body, one column, as many rows; for capacities.
            Values should be independent and uniform; their range becomes [-1, 1].
        washout: rows that are left out at the start.
        test_share: last share of the remaining rows, held out.
        ridge: of the regression, >= 0; see mcmj.fit_readout.
        bias: fit a constant too.
        resolution: of the sensors, in units of the signals: directions in which the signals move
            less (standard deviation) do not count in rank_above_resolution.
        hold: rows that each input is held for; capacities look at the last of them.
        max_delays: largest delay of the capacities' targets, in inputs, for degree 1, 2, ...
    """

    signals: str = "signals.csv"
    targets: str = "targets.csv"
    inputs: str | None = None
    washout: int = 0
    test_share: float = 0.25
    ridge: float = 0.0
    bias: bool = True
    resolution: float | None = None
    hold: int = 1
    max_delays: tuple[int, ...] = (20, 6)

    def __post_init__(self) -> None:
        require_count("washout", self.washout, 0)
        require_number("test_share", self.test_share, 0.01, 0.99)
        require_number("ridge", self.ridge, 0.0)
        if self.resolution is not None:
            require_number("resolution", self.resolution, 0.0, open_low=True)
        require_count("hold", self.hold, 1)
        if not self.max_delays:
            raise InvalidArgumentError("max_delays", "at least one", self.max_delays)
        for delay in self.max_delays:
            require_count("max_delays", delay, 0)
