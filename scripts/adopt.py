"""The same as `mcmj adopt`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("adopt")
