"""Measure every speed claim of mcmj on this machine: ratios, medians, side by side. The same as `mcmj benchmark`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("benchmark")
