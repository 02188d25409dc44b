"""The same as `mcmj prune`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("prune")
