"""Figs. 10 and 11: the input chooses a body's rhythm. With --seeds n: how many bodies learn it. The same as `mcmj input_driven`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("input_driven")
