"""A reduced model as a ``.npz`` file, which NumPy alone reads: matrices, boundary by name and recovery.

The arrays are those of `reduction.rom.ReducedModel` by name; ``boundary_sets`` and ``provenance`` are JSON texts,
the first of rows by name. `reduction.matrix_io.load_matrices` reads it like any ``.npz`` with mass and stiffness.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reduction.errors import RomError
from reduction.npz_file import write_npz
from reduction.rom import ReducedModel
from reduction.whole_file import write_whole

#: What tells a reduced model from plain matrices.
MARK = "boundary_sets"

_ARRAYS = (
    "mass", "damping", "stiffness", "fixed_interface_frequency", "recovery", "boundary_node", "boundary_direction",
    "free",
)  # fmt: skip
_WHOLE = ("boundary_node", "boundary_direction", "free", "n_node")
_AGAIN = "write it again with `save_rom_npz`"
#: Relative asymmetry that still counts as round-off; the solver's own limit is the same.
ASYMMETRY = 1e-9


def save_rom_npz(rom: ReducedModel, path: Path | str) -> None:
    """Write a reduced model; a file of that name is replaced in one step.

    Raises
    ------
    ExchangeError
        The folder does not exist, or the file cannot be written.
    """
    sets = {name: rows.tolist() for name, rows in rom.boundary_sets.items()}
    texts = {MARK: json.dumps(sets), "provenance": json.dumps(dict(rom.provenance))}
    arrays = {name: getattr(rom, name) for name in _ARRAYS}
    write_whole(path, lambda file: write_npz(file, {"n_node": rom.n_node, **arrays, **texts}))


def load_rom_npz(path: Path | str) -> ReducedModel:
    """Read what `save_rom_npz` wrote.

    Raises
    ------
    RomError
        A file that is missing, damaged or no reduced model, arrays that are not real, finite or whole where they must
        be or do not fit together, a matrix that is not symmetric, or a mass that is not positive definite.
    """
    path = Path(path)
    if not path.is_file():
        raise RomError(f'there is no reduced model "{path}": check its name, or write it with `save_rom_npz`')
    arrays, sets, provenance = _read(path)
    _check(path, arrays, sets)
    return ReducedModel(
        **{name: arrays[name] for name in _ARRAYS},
        boundary_sets={name: np.array(rows, dtype=np.int64) for name, rows in sets.items()},
        n_node=int(arrays["n_node"]),
        provenance=provenance,
    )


def _read(path: Path) -> tuple[dict[str, Any], dict[str, list[int]], dict[str, str]]:
    """Arrays, boundary sets and provenance as the file has them."""
    try:
        with np.load(path, allow_pickle=False) as file:
            missing = [name for name in (*_ARRAYS, MARK, "provenance", "n_node") if name not in file]
            if missing:
                raise RomError(
                    f'"{path}" is no reduced model, it has no {missing[0]}: give one that save_rom_npz wrote'
                )
            arrays = {name: file[name] for name in (*_ARRAYS, "n_node")}
            return arrays, json.loads(file[MARK].item()), dict(json.loads(file["provenance"].item()))
    except RomError:
        raise
    except Exception as error:  # a dozen kinds, depending on which byte is damaged
        raise RomError(
            f'"{path}" ({path.stat().st_size} bytes) is cut short, damaged or no .npz file: {_AGAIN}'
        ) from error


def _check(path: Path, arrays: Mapping[str, Any], sets: object) -> None:
    for name, array in arrays.items():
        kinds, wanted = ("iu", "whole") if name in _WHOLE else ("fiu", "real")
        if array.dtype.kind not in kinds:
            raise RomError(f'"{path}": {name} holds {array.dtype} instead of {wanted} numbers: {_AGAIN}')
    _check_shapes(path, arrays)
    for name, array in arrays.items():
        bad = np.argwhere(~np.isfinite(array))
        if len(bad):
            place = tuple(int(each) for each in bad[0])
            raise RomError(f'"{path}": {name} holds {array[place]} at {place}: give finite numbers')
    for name in ("mass", "damping", "stiffness"):
        _check_symmetric(path, name, arrays[name])
    try:
        np.linalg.cholesky(arrays["mass"])
    except np.linalg.LinAlgError:
        raise RomError(f'"{path}": the mass is not positive definite: check its units and signs') from None
    n_node = int(arrays["n_node"])
    for name, end in (("boundary_node", n_node), ("boundary_direction", 3), ("free", 3 * n_node)):
        outside = arrays[name][(arrays[name] < 0) | (arrays[name] >= end)]
        if len(outside):
            raise RomError(f'"{path}": {name} holds {outside[0]}, but there are 0 to {end - 1}: {_AGAIN}')
    _check_sets(path, sets, len(arrays["boundary_node"]))


def _check_shapes(path: Path, arrays: Mapping[str, Any]) -> None:
    r, b, n = (arrays[name].size for name in ("fixed_interface_frequency", "boundary_node", "free"))
    r += b
    wanted = {
        "mass": (r, r), "damping": (r, r), "stiffness": (r, r), "recovery": (n, r), "free": (n,), "n_node": (),
        "boundary_node": (b,), "boundary_direction": (b,), "fixed_interface_frequency": (r - b,),
    }  # fmt: skip
    for name, shape in wanted.items():
        if arrays[name].shape != shape:
            raise RomError(
                f'"{path}": {name} has shape {arrays[name].shape}, but {r} coordinates, {b} of them boundary, '
                f"need {shape}: {_AGAIN}"
            )


def _check_symmetric(path: Path, name: str, matrix: NDArray[np.float64]) -> None:
    skew = np.abs(matrix - matrix.T)
    if skew.size and skew.max() > ASYMMETRY * np.abs(matrix).max():
        i, j = (int(each) for each in np.unravel_index(skew.argmax(), skew.shape))
        raise RomError(
            f'"{path}": {name} is not symmetric: entries ({i}, {j}) and ({j}, {i}) are {matrix[i, j]:g} and '
            f"{matrix[j, i]:g}; write both halves of it"
        )


def _check_sets(path: Path, sets: object, n_boundary: int) -> None:
    if not isinstance(sets, dict):
        raise RomError(f'"{path}": its boundary_sets are no rows by name: {_AGAIN}')
    for name, rows in sets.items():
        if not isinstance(rows, list) or not all(type(row) is int for row in rows):
            raise RomError(f'"{path}": boundary set "{name}" is {rows}: give rows as whole numbers')
        outside = [row for row in rows if not 0 <= row < n_boundary]
        if outside:
            raise RomError(
                f'"{path}": boundary set "{name}" names row {outside[0]}, but there are 0 to {n_boundary - 1}'
            )
