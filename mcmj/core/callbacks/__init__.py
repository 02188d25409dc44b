"""Compiled code that MuJoCo calls within a step: springs, spring laws, the readout, the leapfrog.

`install` puts it in; all that a callback trusts is a key of a table of this process (`law_table`).
"""

from mcmj.utils.compiled_cache import ensure_cache

ensure_cache()  # Numba asks for its cache whenever it sees a function
