"""The same as `mcmj web`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("web")
