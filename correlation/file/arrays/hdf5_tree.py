"""Groups, arrays, texts and references of an HDF5 file; damage is reported in one sentence."""

from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from correlation.errors import CampaignError
from fe.file.hdf5_file import find_unsafe_hdf5_content

#: Highest possible ratio of compression; a larger array is damaged.
HIGHEST_RATIO = 1100
SMALL = 100_000_000
DEEPEST = 30


class Hdf5Tree:
    """Open HDF5 file, as a context manager.

    Parameters
    ----------
    path
        Path of the file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._visited: set[Any] = set()

    def __enter__(self) -> "Hdf5Tree":
        import h5py

        if defect := find_unsafe_hdf5_content(self.path):
            raise CampaignError(f"{self.path.name}: is damaged or cut, it {defect}; copy or export it again")
        try:
            self.root: Any = h5py.File(self.path, "r")
        except (OSError, RuntimeError, ValueError, KeyError) as error:
            raise self.damaged(error) from None
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.root.close()
        if isinstance(error, Exception) and not isinstance(error, CampaignError):
            raise self.damaged(error) from None

    def damaged(self, error: object, name: str = "") -> CampaignError:
        """Error about a damaged file with the message of the library."""
        reason = " ".join(str(error).split())[:200]
        where = f', "{name}"' if name else ""
        return CampaignError(f"{self.path.name}{where}: is damaged or cut ({reason}); copy or export it again")

    def children(self, group: Any, path: str, skipped: dict[str, str]) -> Iterator[tuple[str, Any]]:
        """Members of a group that were not visited before; links to other files are added to `skipped`."""
        import h5py

        if path.count("/") > DEEPEST:
            skipped[path] = "not read: too many groups within each other"
            return
        for key in group:
            name = f"{path}/{key}" if path else key
            link = group.get(key, getlink=True)
            if isinstance(link, h5py.ExternalLink):
                skipped[name] = f"not read: a link to the file {link.filename}"
                continue
            try:
                node = group[key]
            except KeyError as error:
                if not isinstance(link, h5py.SoftLink):
                    raise self.damaged(error, name) from None
                skipped[name] = "not read: a link to nothing"
                continue
            if not isinstance(node, h5py.Group | h5py.Dataset):
                continue
            if isinstance(node, h5py.Group):
                if node in self._visited:
                    skipped[name] = "a second name of a group"
                    continue
                self._visited.add(node)
            yield key, node

    @staticmethod
    def is_group(node: Any) -> bool:
        """Whether a node is a group."""
        import h5py

        return isinstance(node, h5py.Group)

    def attributes(self, node: Any) -> dict[str, str]:
        """Texts and single numbers among the attributes."""
        import h5py

        facts = {}
        for key in node.attrs:
            try:
                value = node.attrs[key]
            except (OSError, TypeError, ValueError, KeyError):  # types unknown to the library
                continue
            if isinstance(value, np.ndarray) and value.size == 1:
                value = value.reshape(-1)[0]
            if isinstance(value, bytes):
                value = value.decode("utf-8", "replace")
            if isinstance(value, str | int | float | np.number | np.bool_):
                facts[str(key)] = str(value)
            elif isinstance(value, h5py.Empty):
                facts[str(key)] = ""
        return facts

    def values(self, node: Any, name: str) -> NDArray[Any] | list[str] | str:
        """Numbers or texts of an array, or the reason why it is not read."""
        import h5py

        kind = node.dtype
        if node.shape is None:
            return "empty"
        if h5py.check_ref_dtype(kind) is not None:
            return "not read: references"
        if h5py.check_vlen_dtype(kind) is not None and h5py.check_string_dtype(kind) is None:
            return "not read: vectors of different lengths"
        nominal = int(np.prod(node.shape, dtype=object)) * kind.itemsize
        if nominal > max(SMALL, HIGHEST_RATIO * self.path.stat().st_size):
            raise self.damaged(f"it says that it has {nominal:.3g} bytes", name)
        try:
            if h5py.check_string_dtype(kind) is not None:
                texts = np.asarray(node.asstr(errors="replace")[()], dtype=object).reshape(-1)
                return [str(text).rstrip("\0") for text in texts]
            content = np.asarray(node[()])
        except (OSError, RuntimeError, ValueError, TypeError) as error:
            raise self.damaged(error, name) from None
        names = content.dtype.names
        if names and len(names) == 2 and {part.lower() for part in names} in ({"real", "imag"}, {"r", "i"}):
            return np.asarray(content[names[0]] + 1j * content[names[1]])
        return content
