"""The body walks: a quadruped in 3-D driven by its own compliant network, switched and pushed. The same as `mcmj walk`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("walk")
