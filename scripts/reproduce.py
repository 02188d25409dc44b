"""The same as `mcmj reproduce`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("reproduce")
