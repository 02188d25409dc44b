"""Reads a .mat file in a process of its own: SciPy's reader can crash on a damaged one.

Run by mjcf.toolbox_net as a script; it knows nothing of mcmj, so that it starts at once. Writes the
structures' numbers and texts as plain arrays, named by their path in the file, to an NPZ file.
"""

import sys
from collections.abc import Iterator

import numpy as np
from scipy.io import loadmat

MEMORY = 2**32  # bytes of address space: a damaged size can ask for more than a machine has


def leaves(value: object, path: str) -> Iterator[tuple[str, np.ndarray]]:
    """Arrays of a nested structure, by their path: P/states; cells and objects are left out."""
    if isinstance(value, dict):
        for key, item in value.items():
            if "/" not in key:  # as in a damaged name
                yield from leaves(item, f"{path}/{key}" if path else key)
    else:
        array = np.asarray(value)
        if array.dtype.kind in "biufcU":
            yield path, array


def main(source: str, target: str) -> None:
    """Convert a file; ends with status 1 and one line if it cannot be read."""
    if sys.platform == "linux":
        import resource  # not on every system

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    try:
        arrays = dict(leaves(loadmat(source, simplify_cells=True), ""))
    except NotImplementedError:
        sys.exit("HDF5 inside; in Matlab: save(.., 'net', '-v7')")
    except Exception as error:  # SciPy raises anything on a damaged file
        sys.exit("not a .mat file (" + " ".join(str(error).split()) + ")")
    with open(target, "wb") as file:
        np.savez(file, **arrays)  # type: ignore[arg-type]  # names of its options, not of ours


if __name__ == "__main__":
    main(*sys.argv[1:])
