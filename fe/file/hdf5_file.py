"""HDF5 files of unknown origin are opened only if a trial process can read them."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from geometry.trial_process import read_in_trial_process

#: Reading speed of the slowest disk [byte/s].
SPEED = 5e6
#: Memory per byte of the file [-]: arrays are read one by one, and compression reduces their bytes at most a thousand
#: times.
MEMORY = 1100
#: Largest number of references of one array that are followed.
MAX_REFERENCES = 100_000


def find_unsafe_hdf5_content(path: Path) -> str | None:
    """Reason not to open an HDF5 file in this process, as the end of a sentence; None for a safe file.

    A damaged file may crash the library, cause an endless loop, or announce arrays that exceed any memory.
    """
    import h5py  # noqa: F401  # imported before the process forks

    return read_in_trial_process(lambda: _read_all(path), path, speed=SPEED, memory=MEMORY)


def _read_all(path: Path) -> None:
    import h5py

    with h5py.File(path, "r") as file:
        visited: set[Any] = set()
        waiting: list[Any] = [file]
        while waiting:
            node = waiting.pop()
            if node not in visited:
                visited.add(node)
                _attempt(_read_attributes, node)
                if isinstance(node, h5py.Group):
                    _attempt(_take_members, node, waiting)
                elif isinstance(node, h5py.Dataset):
                    _attempt(_read_array, file, node)


def _read_attributes(node: Any) -> None:
    for key in node.attrs:
        _attempt(node.attrs.__getitem__, key)


def _take_members(group: Any, waiting: list[Any]) -> None:
    """Add the members of a group that are not in another file."""
    import h5py

    for key in group:
        if not isinstance(_attempt(group.get, key, None, False, True), h5py.ExternalLink):
            member = _attempt(group.__getitem__, key)
            waiting += [] if member is None else [member]


def _read_array(file: Any, node: Any) -> None:
    import h5py

    values = node[()]
    if h5py.check_ref_dtype(node.dtype) is not None:
        for reference in values.reshape(-1)[:MAX_REFERENCES]:
            _attempt(file.__getitem__, reference)


def _attempt(act: Callable[..., Any], *arguments: Any) -> Any:
    """Result of an action; None if it raises an error, which is harmless."""
    try:
        return act(*arguments)
    except MemoryError:
        raise
    except Exception as error:
        if "allocat" in str(error):  # in HDF5's message for a failed allocation
            raise MemoryError from error
        return None
