"""`mcmj` and `python -m mcmj`: the command line."""

import sys


def main(name: str | None = None) -> None:
    """Run the command line; with a name, that experiment with the arguments given."""
    from mcmj.experiments.command_line import main as run  # heavy: not for a mere import

    sys.path.append("")  # one's own modules in the current folder, as for `python -m mcmj`
    run([*([name] if name else []), *sys.argv[1:]])


if __name__ == "__main__":
    main()
