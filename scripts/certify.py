"""Report card of a trained body: errors, Floquet multipliers, region of attraction, tolerances. The same as `mcmj certify`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("certify")
