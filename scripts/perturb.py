"""The same as `mcmj perturb`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("perturb")
