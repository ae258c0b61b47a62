"""Check the content of a file of a reduced model, in any format; each error message is one sentence."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from reduction.array_input import refuse_asymmetric, refuse_infinite
from reduction.errors import RomError

_WHOLE = ("boundary_node", "boundary_direction", "free", "n_node")


def check_rom(where: str, arrays: Mapping[str, Any], sets: object, remedy: str) -> None:
    """Refuse arrays, including ``n_node``, and named boundary rows that are not valid for `reduction.rom.ReducedModel`.

    Messages begin with `where`, the file and the body in it; `remedy` tells how to write the file again.

    Raises
    ------
    RomError
        Arrays that are not real, finite or whole as required or do not fit together, a matrix that is not symmetric, a
        mass that is not positive definite, or rows and nodes that do not exist.
    """
    for name, array in arrays.items():
        kinds, wanted = ("iu", "whole") if name in _WHOLE else ("fiu", "real")
        if array.dtype.kind not in kinds:
            raise RomError(f"{where}: {name} holds {array.dtype} instead of {wanted} numbers: {remedy}")
    _check_shapes(where, arrays, remedy)
    for name, array in arrays.items():
        refuse_infinite(array, f"{where}: {name}", RomError)
    for name in ("mass", "damping", "stiffness"):
        refuse_asymmetric(arrays[name], f"{where}: {name}", RomError)
    try:
        np.linalg.cholesky(arrays["mass"])
    except np.linalg.LinAlgError:
        raise RomError(f"{where}: the mass is not positive definite: check its units and signs") from None
    n_node = int(arrays["n_node"])
    for name, end in (("boundary_node", n_node), ("boundary_direction", 3), ("free", 3 * n_node)):
        outside = arrays[name][(arrays[name] < 0) | (arrays[name] >= end)]
        if len(outside):
            raise RomError(f"{where}: {name} holds {outside[0]}, but there are 0 to {end - 1}: {remedy}")
    _check_sets(where, sets, len(arrays["boundary_node"]), remedy)


def _check_shapes(where: str, arrays: Mapping[str, Any], remedy: str) -> None:
    r, b, n = (arrays[name].size for name in ("fixed_interface_frequency", "boundary_node", "free"))
    r += b
    wanted = {
        "mass": (r, r), "damping": (r, r), "stiffness": (r, r), "recovery": (n, r), "free": (n,), "n_node": (),
        "boundary_node": (b,), "boundary_direction": (b,), "fixed_interface_frequency": (r - b,),
    }  # fmt: skip
    for name, shape in wanted.items():
        if arrays[name].shape != shape:
            raise RomError(
                f"{where}: {name} has shape {arrays[name].shape}, but {r} coordinates, {b} of them boundary, "
                f"need {shape}: {remedy}"
            )


def _check_sets(where: str, sets: object, n_boundary: int, remedy: str) -> None:
    if not isinstance(sets, dict):
        raise RomError(f"{where}: its boundary_sets are no rows by name: {remedy}")
    for name, rows in sets.items():
        if not isinstance(rows, list) or not all(type(row) is int for row in rows):
            raise RomError(f'{where}: boundary set "{name}" is {rows}: give rows as whole numbers')
        outside = [row for row in rows if not 0 <= row < n_boundary]
        if outside:
            raise RomError(
                f'{where}: boundary set "{name}" names row {outside[0]}, but there are 0 to {n_boundary - 1}'
            )
