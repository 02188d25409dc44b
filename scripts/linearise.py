"""Feedback linearisability by Lie brackets, and why arrays of linear springs need diversity. The same as `mcmj linearise`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("linearise")
