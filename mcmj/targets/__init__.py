"""What is taught: limit cycles, gaits, rhythms that an input drives, filters."""

from mcmj.utils.compiled_cache import ensure_cache

ensure_cache()  # Numba asks for its cache whenever it sees a function
