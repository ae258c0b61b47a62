"""Reduced model as a ``.npz`` file, which NumPy can read: matrices, named boundary and recovery.

The arrays have the names of the fields of `reduction.rom.ReducedModel`; ``boundary_sets`` and ``provenance`` are JSON
texts, the first with rows by name. `reduction.file.structure_file.load_matrices` reads it like any ``.npz`` with mass
and stiffness.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from fe.file.npz_archive import read_npz
from reduction.errors import RomError
from reduction.file.atomic_file import write_atomically
from reduction.file.npz import write_npz
from reduction.file.rom_check import check_rom
from reduction.rom import REAL, WHOLE, ReducedModel

#: Variable that distinguishes a reduced model from plain matrices.
MARK = "boundary_sets"

_ARRAYS = (*REAL, *WHOLE)
_AGAIN = "write it again with `save_rom_npz`"


def save_rom_npz(rom: ReducedModel, path: Path | str) -> None:
    """Write a reduced model; an existing file is replaced in one step.

    Raises
    ------
    ExchangeError
        The folder does not exist, or the file cannot be written.
    """
    sets = {name: rows.tolist() for name, rows in rom.boundary_sets.items()}
    texts = {MARK: json.dumps(sets), "provenance": json.dumps(dict(rom.provenance))}
    arrays = {name: getattr(rom, name) for name in _ARRAYS}
    write_atomically(path, lambda file: write_npz(file, {"n_node": rom.n_node, **arrays, **texts}))


def load_rom_npz(path: Path | str) -> ReducedModel:
    """Read a reduced model that `save_rom_npz` wrote.

    Raises
    ------
    RomError
        A file that is missing, damaged or not a reduced model, arrays that are not real, finite or whole as required or
        do not fit together, a matrix that is not symmetric, or a mass that is not positive definite.
    """
    path = Path(path)
    if not path.is_file():
        raise RomError(f'there is no reduced model "{path}": check its name, or write it with `save_rom_npz`')
    arrays, sets, provenance = _read(path)
    check_rom(f'"{path}"', arrays, sets, _AGAIN)
    return ReducedModel(
        **{name: arrays[name] for name in _ARRAYS},
        boundary_sets={name: np.array(rows, dtype=np.int64) for name, rows in sets.items()},
        n_node=int(arrays["n_node"]),
        provenance=provenance,
    )


def _read(path: Path) -> tuple[dict[str, Any], dict[str, list[int]], dict[str, str]]:
    """Arrays, boundary sets and provenance of the file, unchecked."""
    try:
        held = read_npz(path)
        missing = [name for name in (*_ARRAYS, MARK, "provenance", "n_node") if name not in held]
        if missing:
            raise RomError(f'"{path}" is not a reduced model, it has no {missing[0]}: give one that save_rom_npz wrote')
        arrays = {name: held[name] for name in (*_ARRAYS, "n_node")}
        return arrays, json.loads(held[MARK].item()), dict(json.loads(held["provenance"].item()))
    except RomError:
        raise
    except Exception as error:  # many kinds, depending on the damaged byte
        raise RomError(
            f'"{path}" ({path.stat().st_size} bytes) is truncated, damaged or not an .npz file: {_AGAIN}'
        ) from error
