"""The same as `mcmj soft_robot`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("soft_robot")
