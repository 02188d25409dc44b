"""Search bodies and settings of any experiment: screened with the twin, confirmed in MuJoCo. The same as `mcmj search`."""

from mcmj.__main__ import main

if __name__ == "__main__":
    main("search")
