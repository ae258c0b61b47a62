"""Reduced models and assemblies as versioned HDF5 files, checked on reading; layout: see `docs/rom_file.md`."""

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from fe.file.hdf5_file import find_unsafe_hdf5_content
from reduction.assembly import ReducedAssembly
from reduction.errors import RomError
from reduction.file.atomic_file import write_atomically
from reduction.file.rom_check import check_rom
from reduction.rom import REAL, WHOLE, ReducedModel

if TYPE_CHECKING:
    import h5py

T = TypeVar("T")

#: Errors of h5py and NumPy for a damaged file, depending on the damaged byte.
_UNREADABLE = (OSError, LookupError, RuntimeError, ValueError, TypeError, AttributeError, MemoryError, OverflowError)


class Damaged(Exception):
    """Error for contents that do not match their checksum."""


@dataclass(frozen=True, kw_only=True)
class ModelFile:
    """Kind of model file."""

    what: str
    """Name in messages and, after the name of the program, in the attribute ``format``."""
    writer: str
    """Name of the function that writes these files."""
    version: int = 1
    """Format version, increased by one when readers of the previous version would misread a file."""

    def save(self, path: Path | str, fill: Callable[["h5py.File"], None]) -> None:
        """Write a file in one step."""
        import h5py

        def write(temporary: Path) -> None:
            try:
                with h5py.File(temporary, "x") as file:
                    file.attrs["format"] = f"stickslip {self.what}"
                    file.attrs["format_version"] = self.version
                    file.attrs["stickslip_version"] = _find_stickslip_version()
                    file.attrs["created"] = datetime.now(UTC).isoformat(timespec="seconds")
                    fill(file)
            except RuntimeError as error:
                # h5py raises this error if the disk becomes full at certain moments.
                raise OSError(str(error)) from error

        write_atomically(path, write, RomError)

    def load(self, path: Path | str, read: Callable[["h5py.File"], T]) -> T:
        """Read a file that `save` wrote."""
        import h5py

        path, result = Path(path), None
        if not path.is_file():
            raise RomError(f'there is no {self.what} "{path}": check its name, or write it with `{self.writer}`')
        if defect := find_unsafe_hdf5_content(path):
            raise RomError(f'"{path}" is damaged, it {defect}: reduce the system again')
        try:
            with h5py.File(path, "r") as file:
                kind, kind_version = file.attrs.get("format"), file.attrs.get("format_version")
                if (kind, kind_version) == (f"stickslip {self.what}", self.version):
                    result = read(file)
        except RomError:
            raise  # its message is complete
        except Damaged as error:
            raise RomError(
                f'"{path}" is damaged, its contents do not match their checksum: reduce the system again'
            ) from error
        except _UNREADABLE as error:
            raise RomError(
                f'"{path}" ({path.stat().st_size} bytes) is truncated, damaged or not an HDF5 file: reduce the '
                "system again"
            ) from error
        if kind != f"stickslip {self.what}":
            raise RomError(
                f'"{path}" is an HDF5 file but not a stickslip {self.what}: give one that `{self.writer}` wrote'
            )
        if result is None:
            raise RomError(
                f'"{path}" has format version {kind_version}, but this stickslip reads version {self.version}: '
                "reduce the system again, or install the stickslip that wrote it"
            )
        return result


MODEL = ModelFile(what="reduced model", writer="save_rom")
ASSEMBLY = ModelFile(what="reduced assembly", writer="save_assembly")


def save_rom(rom: ReducedModel, path: Path | str) -> None:
    """Write a reduced model; an existing file is replaced in one step, or kept if anything fails.

    Parameters
    ----------
    rom
        Reduced model.
    path
        File to write; its folder must exist.

    Raises
    ------
    RomError
        The folder does not exist, or the file cannot be written.
    """
    MODEL.save(path, lambda file: _write(rom, file))


def load_rom(path: Path | str) -> ReducedModel:
    """Read a reduced model that `save_rom` wrote.

    Raises
    ------
    RomError
        The file is missing, is not a reduced model, has another format version, is truncated or damaged, or has
        contents that `reduction.file.rom_check` refuses.
    """
    return MODEL.load(path, lambda file: _read(file, f'"{path}"'))


def save_assembly(assembly: ReducedAssembly, path: Path | str) -> None:
    """Write a reduced assembly, one group per body; an existing file is replaced in one step.

    Parameters
    ----------
    assembly
        Reduced assembly.
    path
        File to write; its folder must exist.

    Raises
    ------
    RomError
        The folder does not exist, or the file cannot be written.
    """

    def fill(file: "h5py.File") -> None:
        bodies = file.create_group("bodies")
        bodies.attrs["number"] = len(assembly.bodies)
        for number, (name, rom) in enumerate(assembly.bodies.items()):
            group = bodies.create_group(f"{number:06d}")
            group.attrs["name"] = name
            _write(rom, group)

    ASSEMBLY.save(path, fill)


def load_assembly(path: Path | str) -> ReducedAssembly:
    """Read a reduced assembly that `save_assembly` wrote.

    Raises
    ------
    RomError
        As in `load_rom`, for the file or one of its bodies.
    """

    def read(file: "h5py.File") -> ReducedAssembly:
        bodies = [group for _, group in sorted(file["bodies"].items())]
        if len(bodies) != file["bodies"].attrs["number"]:
            raise Damaged
        named = {str(group.attrs["name"]): group for group in bodies}
        return ReducedAssembly(bodies={name: _read(group, f'"{path}", body "{name}"') for name, group in named.items()})

    return ASSEMBLY.load(path, read)


def _write(rom: ReducedModel, group: "h5py.Group") -> None:
    group.attrs["n_node"] = rom.n_node
    arrays = {name: getattr(rom, name) for name in (*REAL, *WHOLE)}
    group.attrs["sha256"] = _compute_checksum(arrays, rom.n_node, rom.boundary_sets, rom.provenance)
    for name, array in arrays.items():
        group.create_dataset(name, data=array, dtype="<f8" if name in REAL else "<i8")
    sets = group.create_group("boundary_sets")
    for number, (name, rows) in enumerate(rom.boundary_sets.items()):
        # Numbered, because a name may contain characters that HDF5 reads as a path.
        sets.create_dataset(f"{number:06d}", data=rows, dtype="<i8").attrs["name"] = name
    group["provenance"] = json.dumps(dict(rom.provenance), ensure_ascii=False)


def _read(group: "h5py.Group", where: str) -> ReducedModel:
    """Read a model that `_write` wrote; messages begin with `where`."""
    arrays: dict[str, Any] = {name: group[name][()] for name in (*REAL, *WHOLE)}
    sets = {str(rows.attrs["name"]): rows[()] for _, rows in sorted(group["boundary_sets"].items())}
    n_node, provenance = group.attrs["n_node"], dict(json.loads(group["provenance"][()]))
    if group.attrs["sha256"] != _compute_checksum(arrays, int(n_node), sets, provenance):
        raise Damaged
    rows_by_name = {name: rows.tolist() for name, rows in sets.items()}
    check_rom(where, {**arrays, "n_node": np.asarray(n_node)}, rows_by_name, "reduce the system again")
    return ReducedModel(**arrays, boundary_sets=sets, n_node=int(n_node), provenance=provenance)


def _compute_checksum(
    arrays: Mapping[str, NDArray[Any]], n_node: int, sets: Mapping[str, NDArray[Any]], provenance: Mapping[str, str]
) -> str:
    """SHA-256 of all contents of a model, including shapes, as hexadecimal digits."""
    digest = hashlib.sha256()
    header = {
        "n_node": n_node,
        "shapes": [values.shape for values in arrays.values()],
        "boundary_sets": {name: rows.tolist() for name, rows in sets.items()},
        "provenance": dict(provenance),
    }
    digest.update(json.dumps(header).encode())
    for values in arrays.values():
        digest.update(np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<")).data)
    return digest.hexdigest()


def _find_stickslip_version() -> str:
    try:
        return version("stickslip")
    except PackageNotFoundError:
        return "not installed"
