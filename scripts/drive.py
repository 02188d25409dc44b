"""The same as `mcmj drive`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("drive")
