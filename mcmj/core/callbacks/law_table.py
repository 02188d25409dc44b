"""The table of this process's compiled spring laws: what a model's user data points to.

A model never holds an address, since a model may come from a file. It holds a key: a number
drawn when the process starts, plus the law's row. A file cannot know it, and every key is
checked before a call:

    row = key - first key;   0 <= row < number of laws;   law made for this number of springs
"""

import secrets
from typing import Any

import numpy as np
from llvmlite import binding, ir
from numba import njit, types

from mcmj.core.callbacks.pointers import integer_words, intrinsic
from mcmj.utils.errors import McmjError

CAPACITY = 4096  # rows of 16 bytes; a compiled law is never freed, a model may still hold its key
_SYMBOL = "mcmj_spring_laws"
_HEAD = 2  # words before the rows: the first key, the number of laws

_TABLE = np.zeros(_HEAD + 2 * CAPACITY, dtype=np.int64)  # rows: address, number of springs
_TABLE[0] = secrets.randbits(40) * CAPACITY + CAPACITY  # exact as a float64, never 0
_ROWS: dict[tuple[int, int], int] = {}
_KEPT: list[Any] = []
binding.add_symbol(_SYMBOL, _TABLE.ctypes.data)


def register(compiled: Any, n_springs: int = 0) -> float:
    """The key of a compiled law (a Numba cfunc): user data of the springs that follow it.

    Args:
        compiled: the law.
        n_springs: springs that a coupled law is made for; 0 for a law of one spring.

    Raises:
        McmjError: the table is full.
    """
    entry = (compiled.address, n_springs)
    if entry not in _ROWS:
        row = len(_KEPT)
        if row == CAPACITY:
            raise McmjError(f"a process holds at most {CAPACITY} compiled spring laws")
        _KEPT.append(compiled)
        _TABLE[_HEAD + 2 * row : _HEAD + 2 * row + 2] = entry
        _TABLE[1] = row + 1
        _ROWS[entry] = row
    return float(_TABLE[0] + _ROWS[entry])


@intrinsic
def _table_address(typingctx: Any) -> Any:
    """The table's address: a symbol, so that compiled code may be cached on disk."""

    def codegen(context, builder, signature, args):
        word, module = ir.IntType(64), builder.module
        table = module.globals.get(_SYMBOL) or ir.GlobalVariable(module, word, _SYMBOL)
        return builder.ptrtoint(table, word)

    return types.int64(), codegen


@njit(cache=True)
def law_address(key, n_springs):
    """The address of the law with this key, 0 if no law of this process has it."""
    table = integer_words(_table_address())
    if not 1.0 <= key <= 2.0**53:  # NaN too
        return 0
    row = types.int64(key) - table[0]
    if row < 0 or row >= table[1] or table[_HEAD + 2 * row + 1] != n_springs:
        return 0
    return table[_HEAD + 2 * row]
