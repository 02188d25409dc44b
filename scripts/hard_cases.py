"""The same as `mcmj hard_cases`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("hard_cases")
