"""How a stage's value is saved into a folder and read back: as JSON, or as JSON beside a file of arrays.

Both know text, numbers (complex ones too), None, lists, tuples, sets, dicts, and dataclasses and enums of the
product; `NPZ` also knows numpy arrays and SciPy sparse matrices. A dataclass is rebuilt by its constructor, so its own
checks run again. Nothing is pickled: a cache entry can never run code. (`study.diagnose.codec` pickles, and reads back
with care.)
"""

import dataclasses
import json
from collections.abc import Callable, Mapping
from enum import Enum
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

from pipeline.code_dependencies import PRODUCT

TREE_FILE = "tree.json"
ARRAY_FILE = "arrays.npz"

# What is not JSON by itself is a list that starts with one of these marks.
_TUPLE, _LIST, _SET, _PAIRS, _COMPLEX, _ENUM, _DATACLASS, _ARRAY, _SPARSE = (
    "tuple", "list", "set", "dict", "complex", "enum", "dataclass", "array", "sparse"
)  # fmt: skip


class Codec(Protocol):
    """Writes a value into an empty folder, and reads it back equal."""

    def save(self, value: Any, folder: Path) -> None:
        """Write the value; TypeError if it is of a kind that this codec does not know."""

    def load(self, folder: Path) -> Any:
        """Read it back; ValueError, KeyError or OSError if the folder does not hold one."""


@dataclasses.dataclass(frozen=True)
class _JsonCodec:
    def save(self, value: Any, folder: Path) -> None:
        (folder / TREE_FILE).write_text(json.dumps(_encode(value, None)), encoding="utf-8")

    def load(self, folder: Path) -> Any:
        return _decode(json.loads((folder / TREE_FILE).read_text(encoding="utf-8")), {})


@dataclasses.dataclass(frozen=True)
class _NpzCodec:
    def save(self, value: Any, folder: Path) -> None:
        import numpy as np

        arrays: dict[str, Any] = {}

        def keep(array: Any) -> str:
            if array.dtype.hasobject:
                raise TypeError(f"an array of {array.dtype} cannot be cached: its elements are Python objects")
            name = f"a{len(arrays)}"
            arrays[name] = array
            return name

        tree = _encode(value, keep)
        (folder / TREE_FILE).write_text(json.dumps(tree), encoding="utf-8")
        np.savez(folder / ARRAY_FILE, **arrays)

    def load(self, folder: Path) -> Any:
        import numpy as np

        with np.load(folder / ARRAY_FILE, allow_pickle=False) as arrays:
            return _decode(json.loads((folder / TREE_FILE).read_text(encoding="utf-8")), arrays)


JSON: Codec = _JsonCodec()
NPZ: Codec = _NpzCodec()


def is_array(value: object) -> bool:
    """Whether a value is a numpy array, found without importing numpy."""
    return (type(value).__module__, type(value).__name__) == ("numpy", "ndarray")


def is_numpy_scalar(value: object) -> bool:
    """Whether a value is a numpy number, text or truth value."""
    return type(value).__module__ == "numpy" and hasattr(value, "item") and not is_array(value)


def is_sparse(value: object) -> bool:
    """Whether a value is a SciPy sparse matrix or array."""
    return type(value).__module__.startswith("scipy.sparse") and hasattr(value, "tocsr")


def _encode(value: Any, keep: Callable[[Any], str] | None) -> Any:
    """Value as JSON; `keep` stores an array and returns its name, or is None where arrays cannot be kept."""
    if is_numpy_scalar(value):
        value = value.item()
    kind = type(value)
    own = kind.__module__.partition(".")[0] in PRODUCT
    if isinstance(value, Enum) and own:  # before numbers: some enums are such
        return [_ENUM, kind.__module__, kind.__qualname__, value.name]
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, complex):
        return [_COMPLEX, value.real, value.imag]
    if isinstance(value, tuple | list | set):
        mark = _TUPLE if isinstance(value, tuple) else _LIST if isinstance(value, list) else _SET
        return [mark, *(_encode(item, keep) for item in value)]
    if isinstance(value, Mapping):
        return [_PAIRS, *([_encode(key, keep), _encode(item, keep)] for key, item in value.items())]
    if dataclasses.is_dataclass(value) and own:
        names = [field.name for field in dataclasses.fields(value) if field.init]
        fields = {name: _encode(getattr(value, name), keep) for name in names}
        return [_DATACLASS, kind.__module__, kind.__qualname__, fields]
    if keep is not None and is_array(value):
        return [_ARRAY, keep(value)]
    if keep is not None and is_sparse(value):
        rows = value.tocsr()
        flavour = "csr_array" if kind.__name__.endswith("_array") else "csr_matrix"
        return [_SPARSE, flavour, list(value.shape), keep(rows.data), keep(rows.indices), keep(rows.indptr)]
    raise TypeError(f"a value of type {kind.__module__}.{kind.__qualname__} cannot be cached by this codec")


def _decode(tree: Any, arrays: Mapping[str, Any]) -> Any:
    if not isinstance(tree, list):
        return tree
    mark, *rest = tree
    if mark == _LIST:
        return [_decode(item, arrays) for item in rest]
    if mark == _TUPLE:
        return tuple(_decode(item, arrays) for item in rest)
    if mark == _SET:
        return {_decode(item, arrays) for item in rest}
    if mark == _PAIRS:
        return {_decode(key, arrays): _decode(item, arrays) for key, item in rest}
    if mark == _COMPLEX:
        return complex(*rest)
    if mark == _ARRAY:
        return arrays[rest[0]]
    if mark == _SPARSE:
        from scipy import sparse

        flavour, shape, data, indices, indptr = rest
        return getattr(sparse, flavour)((arrays[data], arrays[indices], arrays[indptr]), shape=tuple(shape))
    if mark == _ENUM:
        module, name, member = rest
        return _own_class(module, name, "__members__")[member]
    if mark == _DATACLASS:
        module, name, fields = rest
        kind = _own_class(module, name, "__dataclass_fields__")
        return kind(**{field: _decode(value, arrays) for field, value in fields.items()})
    raise ValueError(f"unknown mark {mark!r} in a cache entry")


def _own_class(module: str, name: str, mark: str) -> Any:
    """A class of the product that has what all of its kind have."""
    if module.partition(".")[0] not in PRODUCT:
        raise ValueError(f"a cache entry names the foreign module {module}")
    kind: Any = import_module(module)
    for part in name.split("."):
        kind = getattr(kind, part)
    if not (isinstance(kind, type) and hasattr(kind, mark)):
        raise ValueError(f"a cache entry names {module}.{name}, which is no dataclass or enum")
    return kind
