"""Trials of a store as one flat table: CSV, or Parquet with pyarrow."""

import csv
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mcmj.search.database import TrialStore
from mcmj.utils.extras import extra
from mcmj.utils.files import whole_file


def table(store: TrialStore) -> dict[str, list[Any]]:
    """Columns by name, one entry a trial; None where a trial has no such number.

    Columns of nested fields are named as everywhere: config.teaching.noise by dots, and
    metrics/quadratic/orbit_error as the path of a score.
    """
    rows = [_cells(row) for row in store.rows()]
    names = dict.fromkeys(name for row in rows for name in row)
    return {name: [row.get(name) for row in rows] for name in names}


def write_csv(store: TrialStore, path: str | Path) -> None:
    """The table as CSV, whole or not at all; empty cells for None."""
    columns = table(store)
    with whole_file(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*columns.values(), strict=True))


def write_parquet(store: TrialStore, path: str | Path) -> None:
    """The table as Parquet, whole or not at all.

    Raises:
        MissingExtraError: pyarrow is not installed.
    """
    with extra("search", "Parquet needs pyarrow"):
        import pyarrow
        from pyarrow import parquet
    columns = {name: _one_type(values) for name, values in table(store).items()}
    with whole_file(path) as temporary:
        parquet.write_table(pyarrow.table(columns), temporary)


def _cells(row: Mapping[str, Any]) -> dict[str, Any]:
    """Nested dictionaries as one level; lists as JSON text."""
    cells: dict[str, Any] = {}
    for name, value in row.items():
        cells |= _flat(value, name, "/" if name == "metrics" else ".")
    return cells


def _flat(value: object, name: str, joint: str) -> dict[str, Any]:
    if isinstance(value, Mapping):
        parts = [_flat(item, f"{name}{joint}{key}", joint) for key, item in value.items()]
        return {key: cell for part in parts for key, cell in part.items()}
    return {name: json.dumps(value) if isinstance(value, list) else value}


def _one_type(values: list[Any]) -> list[Any]:
    """A Parquet column has one type: floats where numbers are mixed, else text where types are."""
    types = {type(value) for value in values if value is not None}
    if types == {int, float}:
        return [None if value is None else float(value) for value in values]
    if len(types) > 1:
        return [None if value is None else json.dumps(value) for value in values]
    return values
