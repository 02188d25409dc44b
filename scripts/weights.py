"""What the installation weighs: each package that mcmj needs, and what each extra adds.

.venv/bin/python scripts/weights.py     # of the extras, those that are installed
"""

from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

from packaging.requirements import Requirement

SMALL = 5.0  # MB; lighter ones are one row


def needed(name: str, extras: frozenset[str], found: dict[str, Distribution]) -> None:
    """Add a package and all that it needs; those that are not installed are left out."""
    try:
        one = distribution(name)
    except PackageNotFoundError:
        return
    found[one.metadata["Name"].lower().replace("_", "-")] = one
    for text in one.requires or ():
        wanted = Requirement(text)
        marker = wanted.marker
        asked = marker is None or any(marker.evaluate({"extra": e}) for e in extras or {""})
        if asked and (wanted.extras or wanted.name.lower().replace("_", "-") not in found):
            needed(wanted.name, frozenset(wanted.extras), found)


def size(one: Distribution) -> float:
    """MB of its files, as it came: without what Python compiles."""
    files = (file for file in one.files or () if file.suffix != ".pyc")
    paths = [Path(str(one.locate_file(file))) for file in files]
    return sum(path.stat().st_size for path in paths if path.is_file()) / 1e6


def main() -> None:
    """Print both tables."""
    base: dict[str, Distribution] = {}
    needed("mcmj", frozenset(), base)
    sizes = sorted(((size(one), name) for name, one in base.items()), reverse=True)
    print("| package | MB |\n|---|---|")
    for mb, name in sizes:
        if mb >= SMALL:
            print(f"| {name} | {mb:.0f} |")
    small = [mb for mb, _ in sizes if mb < SMALL]
    print(f"| {len(small)} others | {sum(small):.0f} |")
    print(f"| **all {len(sizes)}** | **{sum(mb for mb, _ in sizes):.0f}** |\n")
    print("| extra | packages more | MB more | the heaviest |\n|---|---|---|---|")
    for extra in distribution("mcmj").metadata.get_all("Provides-Extra") or ():
        more: dict[str, Distribution] = {}
        needed("mcmj", frozenset({extra}), more)
        new = sorted(((size(more[n]), n) for n in more.keys() - base.keys()), reverse=True)
        if new:
            heavy = ", ".join(name for mb, name in new[:3] if mb >= 1.0)
            print(f"| {extra} | {len(new)} | {sum(mb for mb, _ in new):.0f} | {heavy} |")


if __name__ == "__main__":
    main()
