"""The same as `mcmj walk`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("walk")
