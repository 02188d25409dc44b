"""What a body that blows up leaves behind: a result that says so, and the run goes on."""

from collections.abc import Callable
from typing import TypeVar

from mcmj.utils.errors import DivergenceError

Found = TypeVar("Found")
Lost = TypeVar("Lost")


def or_lost(work: Callable[[], Found], lost: Lost) -> Found | Lost:
    """What work() gives; `lost` where a body blew up in it."""
    try:
        return work()
    except DivergenceError:
        return lost
