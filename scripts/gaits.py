"""The same as `mcmj gaits`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("gaits")
