"""The same as `mcmj capacity`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("capacity")
