"""The same as `mcmj speed_accuracy`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("speed_accuracy")
