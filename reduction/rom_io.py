"""A reduced model as a file: HDF5, versioned, checked on reading; the layout stands in `docs/rom_file.md`."""

import hashlib
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from reduction.model_file import Damaged, ModelFile
from reduction.rom import ReducedModel

if TYPE_CHECKING:
    import h5py

FILE = ModelFile(format="stickslip reduced model", version=1, what="reduced model", writer="save_rom")

_FLOAT = ("mass", "damping", "stiffness", "fixed_interface_frequency", "recovery")
_INTEGER = ("boundary_node", "boundary_direction", "free")


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
    FILE.save(path, lambda file: write_rom(rom, file))


def load_rom(path: Path | str) -> ReducedModel:
    """Read a reduced model that `save_rom` wrote.

    Raises
    ------
    RomError
        The file is missing, is no reduced model, has another format version, or is cut short or damaged.
    """
    return FILE.load(path, read_rom)


def write_rom(rom: ReducedModel, group: "h5py.Group") -> None:
    """Write a reduced model into a group of a file."""
    group.attrs["n_node"] = rom.n_node
    group.attrs["sha256"] = _checksum(rom)
    for name in _FLOAT:
        group.create_dataset(name, data=getattr(rom, name), dtype="<f8")
    for name in _INTEGER:
        group.create_dataset(name, data=getattr(rom, name), dtype="<i8")
    sets = group.create_group("boundary_sets")
    for number, (name, rows) in enumerate(rom.boundary_sets.items()):
        # Numbered, since a name may hold characters that HDF5 takes for a path.
        sets.create_dataset(f"{number:06d}", data=rows, dtype="<i8").attrs["name"] = name
    group["provenance"] = json.dumps(dict(rom.provenance), ensure_ascii=False)


def read_rom(group: "h5py.Group") -> ReducedModel:
    """Read what `write_rom` wrote.

    Raises
    ------
    Damaged
        The contents do not match their checksum.
    """
    arrays: dict[str, Any] = {name: group[name][()] for name in (*_FLOAT, *_INTEGER)}
    rom = ReducedModel(
        **arrays,
        boundary_sets={rows.attrs["name"]: rows[()] for _, rows in sorted(group["boundary_sets"].items())},
        n_node=int(group.attrs["n_node"]),
        provenance=json.loads(group["provenance"][()]),
    )
    if group.attrs["sha256"] != _checksum(rom):
        raise Damaged
    return rom


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
