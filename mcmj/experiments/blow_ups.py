"""A body that blows up: it is stepped more finely, or leaves a result that says so."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any, TypeVar

from mcmj.utils.errors import DivergenceError

Found = TypeVar("Found")
Lost = TypeVar("Lost")
Stepped = TypeVar("Stepped", bound=Any)

HALVINGS = 2


def or_lost(work: Callable[[], Found], lost: Lost) -> Found | Lost:
    """What work() gives; `lost` where a body blew up in it."""
    try:
        return work()
    except DivergenceError:
        return lost


def finer(config: Stepped) -> list[Stepped]:
    """An experiment's config, and the same with half its `timestep`, and with a quarter.

    Cubic springs and dampers may make too long a time step that is stable at rest.
    """
    return [replace(config, timestep=config.timestep / 2**k) for k in range(HALVINGS + 1)]


def with_finer_steps(work: Callable[[Stepped], Found], config: Stepped) -> Found:
    """What work(config) gives; where a body blows up, from anew with finer time steps.

    Raises:
        DivergenceError: the body blew up with the finest step too.
    """
    *configs, finest = finer(config)
    for one in configs:
        with suppress(DivergenceError):
            return work(one)
    return work(finest)
