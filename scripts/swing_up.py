"""The same as `mcmj swing_up`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("swing_up")
