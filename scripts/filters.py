"""The same as `mcmj filters`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("filters")
