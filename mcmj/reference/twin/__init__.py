"""The same steps as MuJoCo's, compiled for many small bodies at one time."""

from mcmj.utils.compiled_cache import ensure_cache

ensure_cache()  # Numba asks for its cache whenever it sees a function
