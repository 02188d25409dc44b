"""A nonlinear spring becomes another system by static feedback: error and order by integrator. The same as `mcmj emulate`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("emulate")
