"""The same as `mcmj trunk`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("trunk")
