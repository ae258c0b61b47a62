"""Small arrays of one type as one long array: a file takes as long for a small array as for a large one."""

from collections.abc import Mapping, Sequence
from math import prod
from typing import Any

#: Larger arrays are stored separately, without a copy [bytes].
MAX_COPIED = 8192
#: Prefix of the name of the array with the small ones of a type, followed by the type.
POOL = "pooled_"

#: Place of each array: name of the pooled array, first element there, and shape.
ArrayPlaces = Mapping[str, tuple[str, int, Sequence[int]]]


def pool_arrays(arrays: Mapping[str, Any]) -> tuple[dict[str, Any], ArrayPlaces]:
    """Arrays by name with the small ones concatenated, and their places.

    Small arrays whose elements have several fields, or are not in row order, are kept.
    """
    small: dict[str, list[str]] = {}
    for name, array in arrays.items():
        if array.nbytes <= MAX_COPIED and array.dtype.names is None and array.flags.c_contiguous:
            small.setdefault(POOL + array.dtype.str, []).append(name)
    places: dict[str, tuple[str, int, Sequence[int]]] = {}
    pools: dict[str, Any] = {}
    for pool, names in small.items():
        if len(names) > 1:
            import numpy as np

            pools[pool] = np.concatenate([arrays[name].ravel() for name in names])
            ends = np.cumsum([arrays[name].size for name in names]).tolist()
            places |= {
                name: (pool, end - arrays[name].size, arrays[name].shape) for name, end in zip(names, ends, strict=True)
            }
    return {name: array for name, array in arrays.items() if name not in places} | pools, places


def unpool_array(pool: Any, place: tuple[str, int, Sequence[int]]) -> Any:
    """A separate array, from the pooled array and its place there."""
    _, start, shape = place
    return pool[start : start + prod(shape)].reshape(shape).copy()
