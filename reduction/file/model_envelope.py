"""The envelope of a model in a file: HDF5 with format and version, written in one step, read with care."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from reduction.errors import RomError
from reduction.file.atomic_file import write_whole

if TYPE_CHECKING:
    import h5py

T = TypeVar("T")

#: What h5py and numpy raise, depending on which byte of a file is damaged.
_UNREADABLE = (OSError, LookupError, RuntimeError, ValueError, TypeError, AttributeError, MemoryError, OverflowError)


class Damaged(Exception):
    """Contents that do not match their checksum."""


@dataclass(frozen=True, kw_only=True)
class ModelFile:
    """One kind of file.

    Parameters
    ----------
    format
        Says what it is, in the attribute of that name.
    version
        Raised by one whenever a reader of the version before would misread a file.
    what, writer
        How messages call it, and the function that writes it.
    """

    format: str
    version: int
    what: str
    writer: str

    def save(self, path: Path | str, fill: Callable[["h5py.File"], None]) -> None:
        """Write a file; one of that name is replaced in one step, or left as it was if anything fails.

        Raises
        ------
        RomError
            The folder does not exist, or the file cannot be written.
        """
        import h5py

        def write(temporary: Path) -> None:
            try:
                with h5py.File(temporary, "x") as file:
                    file.attrs["format"] = self.format
                    file.attrs["format_version"] = self.version
                    file.attrs["stickslip_version"] = _stickslip_version()
                    file.attrs["created"] = datetime.now(UTC).isoformat(timespec="seconds")
                    fill(file)
            except RuntimeError as error:
                # What h5py raises, depending on when the disk is full.
                raise OSError(str(error)) from error

        write_whole(path, write, RomError)

    def load(self, path: Path | str, read: Callable[["h5py.File"], T]) -> T:
        """Read a file that `save` wrote.

        Raises
        ------
        RomError
            The file is missing, is of another kind, has another format version, or is cut short or damaged.
        """
        import h5py

        path, found = Path(path), None
        if not path.is_file():
            raise RomError(f'there is no {self.what} "{path}": check its name, or write it with `{self.writer}`')
        try:
            with h5py.File(path, "r") as file:
                kind, kind_version = file.attrs.get("format"), file.attrs.get("format_version")
                if kind == self.format and kind_version == self.version:
                    found = read(file)
        except RomError:
            raise  # a sentence of its own
        except Damaged as error:
            raise RomError(
                f'"{path}" is damaged, its contents do not match their checksum: reduce the system again'
            ) from error
        except _UNREADABLE as error:
            raise RomError(
                f'"{path}" ({path.stat().st_size} bytes) is cut short, damaged or no HDF5 file: reduce the system again'
            ) from error
        if kind != self.format:
            raise RomError(
                f'"{path}" is an HDF5 file but no stickslip {self.what}: give one that `{self.writer}` wrote'
            )
        if found is None:
            raise RomError(
                f'"{path}" has format version {kind_version}, but this stickslip reads version {self.version}: '
                "reduce the system again, or install the stickslip that wrote it"
            )
        return found


def _stickslip_version() -> str:
    try:
        return version("stickslip")
    except PackageNotFoundError:
        return "not installed"
