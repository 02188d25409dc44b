"""The same as `mcmj certify`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("certify")
