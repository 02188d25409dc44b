"""The same as `mcmj input_driven`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("input_driven")
