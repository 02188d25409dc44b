"""The same as `mcmj design`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("design")
