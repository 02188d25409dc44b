"""The same as `mcmj success_rate`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("success_rate")
