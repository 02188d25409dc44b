"""Fig. 7: a taught body swings up from total rest. With --seeds n: how many random bodies do. The same as `mcmj swing_up`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("swing_up")
