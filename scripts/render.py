"""A film of a body at work, as MP4, GIF and PNG: from a body file, or from a trajectory file. The same as `mcmj render`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("render")
