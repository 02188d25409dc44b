"""Numbers that judge a run; each name says its definition."""

from mcmj.utils.compiled_cache import ensure_cache

ensure_cache()  # Numba asks for its cache whenever it sees a function
