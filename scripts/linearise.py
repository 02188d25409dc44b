"""The same as `mcmj linearise`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("linearise")
