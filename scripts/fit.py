"""The same as `mcmj fit`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("fit")
