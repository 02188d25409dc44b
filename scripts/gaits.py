"""Figs. 8 and 9: one body walks, trots, paces and bounds; its readout is switched, not its body. The same as `mcmj gaits`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("gaits")
