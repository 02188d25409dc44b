"""The same as `mcmj emulate`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("emulate")
