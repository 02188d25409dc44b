"""The same as `mcmj limit_cycle`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("limit_cycle")
