"""The same as `mcmj render`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("render")
