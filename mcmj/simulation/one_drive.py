"""One drive at a time: a simulation holds the gate and the callbacks of one only."""

from collections.abc import Iterator
from contextlib import contextmanager

from mcmj.utils.errors import McmjError


class OneDrive:
    """A simulation whose rollouts must not begin inside each other."""

    _driven = False  # a stream has begun and is not at its end

    @contextmanager
    def _only_drive(self) -> Iterator[None]:
        """Refuse a second drive until the block ends.

        Raises:
            McmjError: one is at work.
        """
        if self._driven:
            raise McmjError(
                "a stream or rollout of this simulation is not at its end: finish it or close it "
                "(stream.close()), or use a simulation each"
            )
        self._driven = True
        try:
            yield
        finally:
            self._driven = False
