"""A robot that is its own computer: a trunk of springs on four legs of muscle learns to walk. The same as `mcmj trunk`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("trunk")
