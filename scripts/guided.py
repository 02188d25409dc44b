"""The same as `mcmj guided`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("guided")
