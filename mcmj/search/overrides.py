"""Fields of nested frozen dataclasses by name, as on a command line, or by dotted path."""

import dataclasses
import functools
import json
import types
import typing
from collections.abc import Mapping
from typing import Any, TypeVar

from mcmj.utils.errors import InvalidArgumentError, UnknownNameError

C = TypeVar("C")


def override(config: C, changes: Mapping[str, object]) -> C:
    """A config with other values of fields such as "noise" or "d1".

    A name is looked for in the nested dataclasses too, as the command line's --noise is; with
    dots it is a path ("teaching.noise").
    Values are fitted to the field's type: lists become tuples, integers floats. The new config
    is checked as any: its dataclasses check themselves on construction, once, with all changes
    made.

    Raises:
        UnknownNameError: no such field; the message lists those there are.
        InvalidArgumentError: a value of another type, or one that the config refuses.
    """
    return _override(config, {full_path(config, p): v for p, v in changes.items()}, "")


def value_at(config: Any, path: str) -> object:
    """The value of a config's field, by its name or dotted path.

    Raises:
        UnknownNameError: no such field.
    """
    for name in full_path(config, path).split("."):
        names = [f.name for f in dataclasses.fields(config)]
        if name not in names:
            raise UnknownNameError(f"field of {type(config).__name__}", name, names)
        config = getattr(config, name)
    return config


def full_path(config: object, name: str) -> str:
    """The dotted path of a field that is named alone, dashes for underscores allowed.

    What is unknown, or has dots, is returned as it is.

    Raises:
        InvalidArgumentError: several nested fields have that name.
    """
    name = name.replace("-", "_")
    if "." in name or name in _hints(config):
        return name
    paths = [path for path in _paths(config) if path.rpartition(".")[2] == name]
    if len(paths) > 1:
        raise InvalidArgumentError("setting", f"one of {', '.join(paths)}", repr(name))
    return paths[0] if paths else name


def parse_assignment(text: str) -> tuple[str, object]:
    """ "path=value" -> (path, value); the value is JSON, or else a plain string.

    Raises:
        InvalidArgumentError: no "=", or nothing before it.
    """
    path, sign, value = text.partition("=")
    if not sign or not path.strip():
        raise InvalidArgumentError("setting", "field=value, as in noise=0.1", repr(text))
    return path.strip(), parse_value(value)


def parse_value(text: str) -> object:
    """JSON, or else the text itself."""
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        return text.strip()


def fitted(path: str, value: object, hint: Any) -> object:
    """`value` as the type `hint` of a config's field.

    Raises:
        InvalidArgumentError: it cannot be that.
    """
    try:
        return _fit(value, hint)
    except TypeError:
        raise InvalidArgumentError(
            path, getattr(hint, "__name__", str(hint)), repr(value)
        ) from None


def _paths(config: object, at: str = "") -> list[str]:
    """Dotted paths of all fields."""
    found = []
    for name in _hints(config):
        value = getattr(config, name)
        found.append(at + name)
        if dataclasses.is_dataclass(value):
            found += _paths(value, f"{at}{name}.")
    return found


# --- inside ----------------------------------------------------------------------------------


def _override(config: C, changes: Mapping[str, object], at: str) -> C:
    own: dict[str, object] = {}
    nested: dict[str, dict[str, object]] = {}
    for path, value in changes.items():
        name, _, rest = path.partition(".")
        if name not in _hints(config):
            raise UnknownNameError(f"field of {type(config).__name__}", name, _hints(config))
        if rest:
            nested.setdefault(name, {})[rest] = value
        else:
            own[name] = fitted(at + path, value, _hints(config)[name])
    for name, inner in nested.items():
        part = own.get(name, getattr(config, name))
        if not dataclasses.is_dataclass(part):
            path = f"{at}{name}.{next(iter(inner))}"
            raise InvalidArgumentError(path, f"no fields in {name}", part)
        own[name] = _override(part, inner, f"{at}{name}.")
    return dataclasses.replace(config, **own) if own else config  # type: ignore[type-var]  # checked


def _hints(config: object) -> dict[str, Any]:
    if not dataclasses.is_dataclass(config):
        raise InvalidArgumentError("config", "a dataclass", type(config).__name__)
    return _hints_of(type(config))  # type: ignore[arg-type]  # a class can be hashed


@functools.cache
def _hints_of(kind: type) -> dict[str, Any]:
    hints = typing.get_type_hints(kind)
    return {f.name: hints[f.name] for f in dataclasses.fields(kind) if f.init}


def _fit(value: object, hint: Any) -> object:
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        return _fit_any(value, arguments)
    if origin is tuple:
        return _fit_tuple(value, arguments)
    if hint is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    plain = hint if isinstance(hint, type) else origin
    if not isinstance(plain, type):  # what we do not understand, the config checks
        return value
    if not isinstance(value, plain) or (isinstance(value, bool) and plain in (int, float)):
        raise TypeError
    return value


def _fit_any(value: object, hints: tuple[Any, ...]) -> object:
    for hint in hints:
        try:
            return _fit(value, hint)
        except TypeError:
            continue
    raise TypeError


def _fit_tuple(value: object, hints: tuple[Any, ...]) -> tuple[object, ...]:
    if not isinstance(value, list | tuple):
        raise TypeError
    if len(hints) == 2 and hints[1] is Ellipsis:
        return tuple(_fit(item, hints[0]) for item in value)
    if len(value) != len(hints):
        raise TypeError
    return tuple(_fit(item, hint) for item, hint in zip(value, hints, strict=True))
