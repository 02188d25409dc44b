"""Numbers of nested metrics by path: keys joined by "/", as in eps/0.2/orbit_error."""

from collections.abc import Iterator, Mapping
from typing import TypeGuard

from mcmj.utils.errors import UnknownNameError

ANY = "*"


def numbers_at(metrics: Mapping[str, object], path: str) -> dict[str, float | None]:
    """All numbers at a path into metrics as in metrics.json, by their full paths.

    A key is a name, an index of a list, or "*": every name or index below which the rest of
    the path leads to a number. None stands for a number that is not finite.

    Raises:
        UnknownNameError: the path leads to no number; the message lists those that do.
    """
    found = dict(_numbers(metrics, path.split("/"), ()))
    if not found:
        raise UnknownNameError("number of the metrics", path, {*_paths(metrics, ())})
    return found


def matched(path: str, pattern: str) -> str:
    """What the "*" of a pattern stand for in a path that it leads to; without any, the path."""
    pairs = zip(path.split("/"), pattern.split("/"), strict=True)
    return "/".join(key for key, wanted in pairs if wanted == ANY) or path


def quantity(pattern: str) -> str:
    """The last key of a pattern that is a name, for people."""
    names = [key for key in pattern.split("/") if key != ANY]
    return names[-1].replace("_", " ") if names else "number"


# --- inside ----------------------------------------------------------------------------------


def _numbers(
    node: object, keys: list[str], at: tuple[str, ...]
) -> Iterator[tuple[str, float | None]]:
    if not keys:
        if _is_number(node):
            yield "/".join(at), None if node is None else float(node)
        return
    inside = _inside(node)
    for key in inside if keys[0] == ANY else keys[:1]:
        if key in inside:
            yield from _numbers(inside[key], keys[1:], (*at, key))


def _paths(node: object, at: tuple[str, ...]) -> Iterator[str]:
    """Paths to all numbers, one for all items of a list."""
    if _is_number(node):
        yield "/".join(at)
    for key, item in _inside(node).items():
        yield from _paths(item, (*at, ANY if isinstance(node, list) else key))


def _is_number(node: object) -> TypeGuard[float | None]:
    return node is None or (isinstance(node, int | float) and not isinstance(node, bool))


def _inside(node: object) -> Mapping[str, object]:
    if isinstance(node, list):
        return {str(index): item for index, item in enumerate(node)}
    return node if isinstance(node, Mapping) else {}
