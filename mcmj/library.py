"""The bodies that come with mcmj."""

from pathlib import Path

from mcmj.errors import UnknownNameError

# beside the package in the repository; inside it in an installed wheel
_FOLDERS = (Path(__file__).parent / "bodies", Path(__file__).parent.parent / "bodies")


def body_names() -> list[str]:
    """Names of the bodies that come with mcmj."""
    return sorted(path.stem for folder in _FOLDERS for path in folder.glob("*.xml"))


def body_path(name: str) -> Path:
    """Path of a body file: a file that exists, or the name of a body that comes with mcmj.

    Raises:
        UnknownNameError: neither.
    """
    if not name or Path(name).is_dir():
        raise UnknownNameError("body", name, [*body_names(), "a path to an .xml file"])
    given = Path(name)
    if given.suffix == ".xml" or given.exists():
        return given
    for folder in _FOLDERS:
        if (folder / f"{name}.xml").is_file():
            return folder / f"{name}.xml"
    raise UnknownNameError("body", name, [*body_names(), "a path to an .xml file"])
