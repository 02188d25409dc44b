"""The cross-entropy method learns to drive a body by its input channel, as a dm_control task. The same as `mcmj drive`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("drive")
