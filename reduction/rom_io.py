"""A reduced model as a file: HDF5, versioned, checked on reading; the layout stands in `docs/rom_file.md`."""

import hashlib
import json
import uuid
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from reduction.errors import RomError
from reduction.rom import ReducedModel

if TYPE_CHECKING:
    import h5py

FORMAT = "stickslip reduced model"
#: Raised by one whenever a reader of the version before would misread a file.
FORMAT_VERSION = 1

_FLOAT = ("mass", "damping", "stiffness", "fixed_interface_frequency", "recovery")
_INTEGER = ("boundary_node", "boundary_direction", "free")
#: What h5py and numpy raise, depending on which byte of a file is damaged.
_UNREADABLE = (OSError, LookupError, RuntimeError, ValueError, TypeError, AttributeError, MemoryError, OverflowError)


def save_rom(rom: ReducedModel, path: Path | str) -> None:
    """Write a reduced model; a file of that name is replaced in one step, or left as it was if anything fails.

    Parameters
    ----------
    rom
        The model.
    path
        The file; its folder must exist.

    Raises
    ------
    RomError
        The folder does not exist, or the file cannot be written.
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise RomError(f'"{path}" cannot be written: there is no folder "{path.parent}", create it first')
    temporary = path.with_name(f".{path.name}.{uuid.uuid4().hex}.part")
    try:
        _write(rom, temporary)
        temporary.replace(path)
    except (OSError, RuntimeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise RomError(f'"{path}" cannot be written ({reason}): choose another folder, or free space in it') from error
    finally:
        temporary.unlink(missing_ok=True)


def load_rom(path: Path | str) -> ReducedModel:
    """Read a reduced model that `save_rom` wrote.

    Raises
    ------
    RomError
        The file is missing, is no reduced model, has another format version, or is cut short or damaged.
    """
    import h5py

    path = Path(path)
    if not path.is_file():
        raise RomError(f'there is no reduced model "{path}": check its name, or write it with `save_rom`')
    rom = checksum = None
    try:
        with h5py.File(path, "r") as file:
            kind, kind_version = file.attrs.get("format"), file.attrs.get("format_version")
            if kind == FORMAT and kind_version == FORMAT_VERSION:
                rom, checksum = _read(file), file.attrs["sha256"]
    except _UNREADABLE as error:
        raise RomError(
            f'"{path}" ({path.stat().st_size} bytes) is cut short, damaged or no HDF5 file: reduce the system again'
        ) from error
    if kind != FORMAT:
        raise RomError(f'"{path}" is an HDF5 file but no stickslip reduced model: give one that `save_rom` wrote')
    if rom is None:
        raise RomError(
            f'"{path}" has format version {kind_version}, but this stickslip reads version {FORMAT_VERSION}: '
            "reduce the system again, or install the stickslip that wrote it"
        )
    if checksum != _checksum(rom):
        raise RomError(f'"{path}" is damaged, its contents do not match their checksum: reduce the system again')
    return rom


def _write(rom: ReducedModel, path: Path) -> None:
    import h5py

    with h5py.File(path, "x") as file:
        file.attrs["format"] = FORMAT
        file.attrs["format_version"] = FORMAT_VERSION
        file.attrs["stickslip_version"] = _stickslip_version()
        file.attrs["created"] = datetime.now(UTC).isoformat(timespec="seconds")
        file.attrs["n_node"] = rom.n_node
        file.attrs["sha256"] = _checksum(rom)
        for name in _FLOAT:
            file.create_dataset(name, data=getattr(rom, name), dtype="<f8")
        for name in _INTEGER:
            file.create_dataset(name, data=getattr(rom, name), dtype="<i8")
        sets = file.create_group("boundary_sets")
        for number, (name, rows) in enumerate(rom.boundary_sets.items()):
            # Numbered, since a name may hold characters that HDF5 takes for a path.
            sets.create_dataset(f"{number:06d}", data=rows, dtype="<i8").attrs["name"] = name
        file["provenance"] = json.dumps(dict(rom.provenance), ensure_ascii=False)


def _read(file: "h5py.File") -> ReducedModel:
    arrays: dict[str, Any] = {name: file[name][()] for name in (*_FLOAT, *_INTEGER)}
    return ReducedModel(
        **arrays,
        boundary_sets={rows.attrs["name"]: rows[()] for _, rows in sorted(file["boundary_sets"].items())},
        n_node=int(file.attrs["n_node"]),
        provenance=json.loads(file["provenance"][()]),
    )


def _checksum(rom: ReducedModel) -> str:
    """SHA-256 of all that the model holds, with the shapes, as hexadecimal digits."""
    digest = hashlib.sha256()
    header = {
        "n_node": rom.n_node,
        "shapes": [getattr(rom, name).shape for name in (*_FLOAT, *_INTEGER)],
        "boundary_sets": {name: rows.tolist() for name, rows in rom.boundary_sets.items()},
        "provenance": dict(rom.provenance),
    }
    digest.update(json.dumps(header).encode())
    for name in (*_FLOAT, *_INTEGER):
        values = getattr(rom, name)
        digest.update(np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<")).data)
    return digest.hexdigest()


def _stickslip_version() -> str:
    try:
        return version("stickslip")
    except PackageNotFoundError:
        return "not installed"
