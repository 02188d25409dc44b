"""The same as `mcmj search`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("search")
