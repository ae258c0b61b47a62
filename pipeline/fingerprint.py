"""Hash of everything that determines a stage's result: its inputs, its code and the numerical libraries."""

import dataclasses
import hashlib
import importlib.metadata
import json
import sys
from collections.abc import Mapping, Set
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any

from geometry.registry import REGISTRIES
from pipeline.code_dependencies import dependencies
from pipeline.codec import is_array, is_numpy_scalar, is_sparse
from pipeline.source_facts import find_source_facts

#: Libraries whose results may change in the last digits from one version to the next.
NUMERICAL_LIBRARIES = ("numpy", "scipy")
#: Bytes of an array that are copied at a time: a reduced model has gigabytes of them.
AT_ONCE = 16_000_000


def make_canonical(value: Any) -> Any:
    """A value as JSON that is equal only for equal values.

    Floats are their shortest exact text, arrays and files their bytes, dataclasses their class and fields; dicts are
    sorted.

    Parameters
    ----------
    value
        Input of a stage.

    Raises
    ------
    TypeError
        A value whose content is not accessible, such as a function or an open file.
    """
    if is_numpy_scalar(value):
        value = value.item()
    if isinstance(value, Enum):
        return ["enum", _name(type(value)), value.name]
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return ["float", repr(value)]
    if isinstance(value, complex):
        return ["complex", repr(value)]
    if isinstance(value, bytes):
        return ["bytes", hashlib.sha256(value).hexdigest()]
    if isinstance(value, Path):
        return ["file", hashlib.sha256(value.read_bytes()).hexdigest()]
    if isinstance(value, list | tuple):
        return [type(value).__name__, *(make_canonical(item) for item in value)]
    if isinstance(value, Set):
        return ["set", *sorted((make_canonical(item) for item in value), key=json.dumps)]
    if isinstance(value, Mapping):
        pairs = ([make_canonical(key), make_canonical(item)] for key, item in value.items())
        return ["dict", *sorted(pairs, key=lambda pair: json.dumps(pair[0]))]
    return _make_canonical_object(value)


def _make_canonical_object(value: Any) -> Any:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {field.name: make_canonical(getattr(value, field.name)) for field in dataclasses.fields(value)}
        return ["object", _name(type(value)), fields]
    if is_array(value):
        if value.dtype.hasobject:
            raise TypeError(
                f"an array of {value.dtype} cannot be the input of a cached stage: its content cannot be seen"
            )
        return ["array", value.dtype.str, list(value.shape), _hash_array(value)]
    if is_sparse(value):
        rows = value.tocsr(copy=True)
        rows.sum_duplicates()
        parts = (rows.data, rows.indices, rows.indptr)
        return ["sparse", list(rows.shape), *(make_canonical(part) for part in parts)]
    if hasattr(value, "model_fields") and hasattr(value, "model_dump"):
        fields = {name: make_canonical(getattr(value, name)) for name in type(value).model_fields}
        return ["model", _name(type(value)), fields]
    raise TypeError(f"{_name(type(value))} cannot be the input of a cached stage: its content cannot be seen")


def _hash_array(array: Any) -> str:
    """Hash of the bytes of an array in C order, whatever its layout in memory, without a copy of the whole array."""
    digest = hashlib.sha256()
    rows = array if array.ndim else array.reshape(1)
    step = max(1, AT_ONCE * len(rows) // max(rows.nbytes, 1))
    for first in range(0, len(rows), step):
        digest.update(rows[first : first + step].tobytes())
    return digest.hexdigest()


@cache
def hash_code(module: str) -> str:
    """Hash of the code that a module's results depend on, blind to comments, docstrings and layout.

    Parameters
    ----------
    module
        Import name; what it imports counts too (`pipeline.code_dependencies`).

    Returns
    -------
    Hexadecimal; it changes with the version of Python and of the numerical libraries too.
    """
    digest = hashlib.sha256(f"python {sys.version_info[:2]}".encode())
    for library in NUMERICAL_LIBRARIES:
        digest.update(f" {library} {importlib.metadata.version(library)}".encode())
    for name, file in sorted(dependencies(module).items()):
        digest.update(f"\n{name}\n{find_source_facts(file).code}".encode())
    return digest.hexdigest()


def key(stage: str, inputs: Mapping[str, Any], module: str) -> str:
    """Name of a stage's result: hexadecimal, the same on every run with equal inputs and code of a module."""
    text = json.dumps([stage, make_canonical(inputs), hash_code(module), _hash_outside_members(module)], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def _hash_outside_members(module: str) -> list[str]:
    """Hashes of files from which members came, such as a user's joint law, into registries that a module uses."""
    used = dependencies(module)
    files = {file for registry in REGISTRIES if registry.package in used for file in registry.outside_files()}
    return [find_source_facts(file).code for file in sorted(files)]


def _name(kind: type) -> str:
    return f"{kind.__module__}.{kind.__qualname__}"
