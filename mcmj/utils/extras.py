"""Packages that are not needed by all: mcmj's extras."""

from collections.abc import Iterator
from contextlib import contextmanager

from mcmj.utils.errors import MissingExtraError


@contextmanager
def extra(name: str, purpose: str) -> Iterator[None]:
    """Imports inside the block are those of an extra.

    Args:
        name: of the extra, as in pyproject.toml.
        purpose: what needs what, as in "Parquet needs pyarrow".

    Raises:
        MissingExtraError: one of them cannot be imported.
    """
    try:
        yield
    except ImportError as error:
        raise MissingExtraError(purpose, name, error) from error
