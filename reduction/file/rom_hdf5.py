"""A reduced model as a file: HDF5, versioned, checked on reading; the layout stands in `docs/rom_file.md`."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from reduction.file.model_envelope import Damaged, ModelFile
from reduction.file.rom_check import check_rom
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
        The file is missing, is no reduced model, has another format version, is cut short or damaged, or holds what
        `reduction.file.rom_check` refuses.
    """
    return FILE.load(path, lambda file: read_rom(file, f'"{path}"'))


def write_rom(rom: ReducedModel, group: "h5py.Group") -> None:
    """Write a reduced model into a group of a file."""
    group.attrs["n_node"] = rom.n_node
    group.attrs["sha256"] = _checksum(
        {name: getattr(rom, name) for name in (*_FLOAT, *_INTEGER)}, rom.n_node, rom.boundary_sets, rom.provenance
    )
    for name in _FLOAT:
        group.create_dataset(name, data=getattr(rom, name), dtype="<f8")
    for name in _INTEGER:
        group.create_dataset(name, data=getattr(rom, name), dtype="<i8")
    sets = group.create_group("boundary_sets")
    for number, (name, rows) in enumerate(rom.boundary_sets.items()):
        # Numbered, since a name may hold characters that HDF5 takes for a path.
        sets.create_dataset(f"{number:06d}", data=rows, dtype="<i8").attrs["name"] = name
    group["provenance"] = json.dumps(dict(rom.provenance), ensure_ascii=False)


def read_rom(group: "h5py.Group", where: str) -> ReducedModel:
    """Read what `write_rom` wrote.

    Parameters
    ----------
    group
        Of an open file.
    where
        The file, and the body within it, as a message begins.

    Raises
    ------
    Damaged
        The contents do not match their checksum.
    RomError
        They do, but are no reduced model.
    """
    arrays: dict[str, Any] = {name: group[name][()] for name in (*_FLOAT, *_INTEGER)}
    sets = {str(rows.attrs["name"]): rows[()] for _, rows in sorted(group["boundary_sets"].items())}
    n_node, provenance = group.attrs["n_node"], dict(json.loads(group["provenance"][()]))
    if group.attrs["sha256"] != _checksum(arrays, int(n_node), sets, provenance):
        raise Damaged
    rows_by_name = {name: rows.tolist() for name, rows in sets.items()}
    check_rom(where, {**arrays, "n_node": np.asarray(n_node)}, rows_by_name, "reduce the system again")
    return ReducedModel(**arrays, boundary_sets=sets, n_node=int(n_node), provenance=provenance)


def _checksum(
    arrays: Mapping[str, NDArray[Any]], n_node: int, sets: Mapping[str, NDArray[Any]], provenance: Mapping[str, str]
) -> str:
    """SHA-256 of all that a model holds, with the shapes, as hexadecimal digits."""
    digest = hashlib.sha256()
    header = {
        "n_node": n_node,
        "shapes": [arrays[name].shape for name in (*_FLOAT, *_INTEGER)],
        "boundary_sets": {name: rows.tolist() for name, rows in sets.items()},
        "provenance": dict(provenance),
    }
    digest.update(json.dumps(header).encode())
    for name in (*_FLOAT, *_INTEGER):
        values = arrays[name]
        digest.update(np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<")).data)
    return digest.hexdigest()
