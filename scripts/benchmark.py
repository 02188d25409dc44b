"""The same as `mcmj benchmark`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("benchmark")
