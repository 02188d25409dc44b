"""Fig. 6: disturb a taught rhythm in four ways and watch it come back; noise tolerance. The same as `mcmj perturb`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("perturb")
