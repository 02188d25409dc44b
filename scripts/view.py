"""The same as `mcmj view`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("view")
