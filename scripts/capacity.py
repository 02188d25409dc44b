"""Memory and processing capacity, kernel and generalisation rank of a body; maps of them. The same as `mcmj capacity`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("capacity")
