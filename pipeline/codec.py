"""Conversion of a value to a JSON tree plus numpy arrays, and back.

Supported are text, numbers, None, lists, tuples, sets, mappings, paths, numpy arrays and scalars, SciPy sparse
matrices, dataclasses, named tuples and enums of the product, and objects of external classes: those of a file of
effects or joint laws that this process has read, or of an installed package with members. An object that a value
contains several times is written once, and is one object again after reading.

Nothing is pickled. A dataclass is rebuilt by its constructor, so that its checks run again; no file is run and no
package is imported that this process does not use already.
"""

import copyreg
import dataclasses
import sys
from collections.abc import Callable, Mapping
from enum import Enum
from functools import cache
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any

from geometry.registry import REGISTRIES, installed_points
from pipeline.code_dependencies import PRODUCT

#: Marks at the start of a list that encodes a value beyond JSON: one of these, or a name of `_CONTAINERS` or `_PARTS`.
_SAME, _CLASS, _ENUM, _OBJECT, _ARRAY, _NUMBER, _SPARSE = (
    "same", "dataclass", "enum", "object", "array", "number", "sparse"
)  # fmt: skip
#: Containers by their exact type.
_CONTAINERS: dict[str, Any] = {
    "list": list, "tuple": tuple, "set": set, "frozenset": frozenset, "dict": dict, "frozen dict": MappingProxyType
}  # fmt: skip
#: Other plain values: their class, and the arguments to rebuild them.
_PARTS: dict[str, tuple[type, Callable[[Any], tuple[Any, ...]]]] = {
    "complex": (complex, lambda value: (value.real, value.imag)),
    "path": (Path, lambda value: (str(value),)),
    "range": (range, lambda value: (value.start, value.stop, value.step)),
    "slice": (slice, lambda value: (value.start, value.stop, value.step)),
}
#: Prefixes of modules of users' files, from `geometry.registry` and `diagnosis.candidate.user_effect`.
_USER_FILE = "stickslip_"


def is_array(value: object) -> bool:
    """Whether a value is a numpy array, found without importing numpy."""
    return (type(value).__module__, type(value).__name__) == ("numpy", "ndarray")


def is_numpy_scalar(value: object) -> bool:
    """Whether a value is a numpy number, text or truth value."""
    return type(value).__module__ == "numpy" and hasattr(value, "item") and not is_array(value)


def is_sparse(value: object) -> bool:
    """Whether a value is a SciPy sparse matrix or array."""
    return type(value).__module__.startswith("scipy.sparse") and hasattr(value, "tocsr")


def encode(value: Any) -> tuple[Any, dict[str, Any]]:
    """Tree and arrays of a value.

    Returns
    -------
    A tree for `json.dumps`, and the numpy arrays by their names in the tree.

    Raises
    ------
    TypeError
        A value of an unsupported kind; the message names its class.
    """
    encoder = _Encoder()
    return encoder.tree(value), encoder.arrays


def decode(tree: Any, array: Callable[[str], Any]) -> Any:
    """The value of a tree.

    Parameters
    ----------
    tree
        Tree from `encode`.
    array
        Gives an array by its name.

    Raises
    ------
    ValueError, LookupError, TypeError, AttributeError, ImportError
        A tree that was not written by this version of the code, or with a class that is not permitted.
    """
    return _Decoder(array).value(tree)


class _Encoder:
    def __init__(self) -> None:
        self.arrays: dict[str, Any] = {}
        # Numbers of written objects by identity, which is unique while all of them are alive.
        self._numbers: dict[int, int] = {}
        self._alive: list[Any] = []

    def tree(self, value: Any) -> Any:
        if value is None or (isinstance(value, bool | int | float | str) and not _is_special(value)):
            return value
        if id(value) in self._numbers:
            return [_SAME, self._numbers[id(value)]]
        tree = self._marked(value)
        self._numbers[id(value)] = len(self._alive)
        self._alive.append(value)
        return tree

    def _marked(self, value: Any) -> list[Any]:
        kind = type(value)
        for name, container in _CONTAINERS.items():
            if kind is container:
                if isinstance(value, Mapping):
                    return [name, *([self.tree(key), self.tree(item)] for key, item in value.items())]
                return [name, *map(self.tree, value)]
        if is_array(value):
            return [_ARRAY, self._array(value)]
        if is_numpy_scalar(value):
            return [_NUMBER, value.dtype.str, self.tree(value.item())]
        for name, (base, parts) in _PARTS.items():
            if isinstance(value, base):
                return [name, *map(self.tree, parts(value))]
        if is_sparse(value):
            rows = value.tocsr()
            flavour = "csr_array" if kind.__name__.endswith("_array") else "csr_matrix"
            return [_SPARSE, flavour, list(value.shape), *map(self._array, (rows.data, rows.indices, rows.indptr))]
        return self._of_class(value, kind)

    def _of_class(self, value: Any, kind: type) -> list[Any]:
        place = [kind.__module__, kind.__qualname__]
        if _is_own(kind.__module__) or _is_outside(kind.__module__):
            if isinstance(value, Enum):
                return [_ENUM, *place, value.name]
            if dataclasses.is_dataclass(value) and _is_own(kind.__module__):
                names = [field.name for field in dataclasses.fields(value) if field.init]
                return [_CLASS, *place, {name: self.tree(getattr(value, name)) for name in names}]
            if _is_outside(kind.__module__) or hasattr(value, "_fields"):
                make, arguments, state, *items = (*value.__reduce_ex__(2), None, None, None)[:5]
                if make is copyreg.__newobj__ and items == [None, None]:  # type: ignore[attr-defined]
                    return [_OBJECT, *place, self.tree(arguments[1:]), self.tree(state)]
        if isinstance(value, Mapping):
            return ["dict", *([self.tree(key), self.tree(item)] for key, item in value.items())]
        raise TypeError(f"a value of type {kind.__module__}.{kind.__qualname__} cannot be stored")

    def _array(self, array: Any) -> str:
        if array.dtype.hasobject:
            raise TypeError(f"an array of {array.dtype} cannot be stored: its elements are Python objects")
        name = str(len(self.arrays))
        self.arrays[name] = array
        return name


class _Decoder:
    def __init__(self, array: Callable[[str], Any]) -> None:
        self._array = array
        self._read: list[Any] = []

    def value(self, tree: Any) -> Any:
        if not isinstance(tree, list):
            return tree
        mark, *rest = tree
        if mark == _SAME:
            return self._read[rest[0]]
        value = self._unmarked(mark, rest)
        self._read.append(value)
        return value

    def _unmarked(self, mark: str, rest: list[Any]) -> Any:
        if mark in {"dict", "frozen dict"}:
            return _CONTAINERS[mark]({self.value(key): self.value(item) for key, item in rest})
        if mark in _CONTAINERS:
            return _CONTAINERS[mark]([self.value(item) for item in rest])
        if mark in _PARTS:
            return _PARTS[mark][0](*map(self.value, rest))
        if mark == _ARRAY:
            return self._array(rest[0])
        if mark == _NUMBER:
            import numpy as np

            return np.dtype(rest[0]).type(self.value(rest[1]))
        if mark == _SPARSE:
            from scipy import sparse

            flavour, shape, *names = rest
            return getattr(sparse, flavour)(tuple(map(self._array, names)), shape=tuple(shape))
        return self._of_class(mark, rest)

    def _of_class(self, mark: str, rest: list[Any]) -> Any:
        module, name, *given = rest
        if mark == _ENUM:
            return _find_class(module, name, "__members__")[given[0]]
        if mark == _CLASS:
            kind = _find_class(module, name, "__dataclass_fields__")
            return kind(**{field: self.value(item) for field, item in given[0].items()})
        if mark == _OBJECT:
            kind = _find_class(module, name, "__class__" if _is_outside(module) else "_fields")
            made = kind.__new__(kind, *self.value(given[0]))
            return _with_state(made, self.value(given[1]))
        raise ValueError(f"unknown mark {mark!r} in a stored value")


def _is_special(value: object) -> bool:
    """Whether a number or text is of a class that must be kept."""
    return isinstance(value, Enum) or is_numpy_scalar(value)


def _with_state(made: Any, state: Any) -> Any:
    """An object of an external class with its attributes, as `copy.copy` sets them."""
    if hasattr(made, "__setstate__"):
        made.__setstate__(state)
        return made
    for attributes in state if isinstance(state, tuple) else (state,):
        for name, value in (attributes or {}).items():
            object.__setattr__(made, name, value)
    return made


def _is_own(module: str) -> bool:
    return module.partition(".")[0] in PRODUCT


def _is_outside(module: str) -> bool:
    """Whether a loaded module is a user's file with members, or belongs to an installed package with members."""
    return module in sys.modules and (module.startswith(_USER_FILE) or module.partition(".")[0] in _packages())


@cache
def _packages() -> frozenset[str]:
    """Installed packages with members of any registry."""
    groups = {registry.group for registry in REGISTRIES if registry.group}
    points = (point for group in groups for point in installed_points(group))
    return frozenset(point.value.partition(":")[0].partition(".")[0] for point in points)


def _find_class(module: str, name: str, mark: str) -> Any:
    """A class of the product or an external one that has the attributes of its kind."""
    if not (_is_own(module) or _is_outside(module)):
        raise ValueError(f"a stored value names the foreign module {module}")
    kind: Any = import_module(module)
    for part in name.split("."):
        kind = getattr(kind, part)
    if not (isinstance(kind, type) and kind.__module__ == module and hasattr(kind, mark)):
        raise ValueError(f"a stored value names {module}.{name}, which is not a class of that kind")
    return kind
