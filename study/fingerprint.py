"""What a stage's result depends on, as one number: its inputs, its code and the numerical libraries below it."""

import ast
import dataclasses
import hashlib
import importlib.metadata
import importlib.util
import json
import sys
from collections.abc import Iterable, Mapping, Set
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any

from study.codec import is_array, is_numpy_scalar, is_sparse

# Their results may change in the last digits from one version to the next.
NUMERICAL_LIBRARIES = ("numpy", "scipy")


def canonical(value: Any) -> Any:
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
        A value whose content cannot be seen, such as a function or an open file.
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
        return [type(value).__name__, *(canonical(item) for item in value)]
    if isinstance(value, Set):
        return ["set", *sorted((canonical(item) for item in value), key=json.dumps)]
    if isinstance(value, Mapping):
        pairs = ([canonical(key), canonical(item)] for key, item in value.items())
        return ["dict", *sorted(pairs, key=lambda pair: json.dumps(pair[0]))]
    return _canonical_object(value)


def _canonical_object(value: Any) -> Any:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {field.name: canonical(getattr(value, field.name)) for field in dataclasses.fields(value)}
        return ["object", _name(type(value)), fields]
    if is_array(value):
        if value.dtype.hasobject:
            raise TypeError(
                f"an array of {value.dtype} cannot be the input of a cached stage: its content cannot be seen"
            )
        # Bytes in C order whatever the layout in memory.
        return ["array", value.dtype.str, list(value.shape), hashlib.sha256(value.tobytes()).hexdigest()]
    if is_sparse(value):
        rows = value.tocsr(copy=True)
        rows.sum_duplicates()
        parts = (rows.data, rows.indices, rows.indptr)
        return ["sparse", list(rows.shape), *(canonical(part) for part in parts)]
    if hasattr(value, "model_fields") and hasattr(value, "model_dump"):
        fields = {name: canonical(getattr(value, name)) for name in type(value).model_fields}
        return ["model", _name(type(value)), fields]
    raise TypeError(f"{_name(type(value))} cannot be the input of a cached stage: its content cannot be seen")


@cache
def code_version(rooms: Iterable[str]) -> str:
    """Hash of the code of some rooms, blind to comments, docstrings and layout.

    Parameters
    ----------
    rooms
        Import names of packages or modules; hashable, e.g. a tuple. A package stands for all modules below it.

    Returns
    -------
    Hexadecimal; it changes with the version of Python and of the numerical libraries too.
    """
    digest = hashlib.sha256(f"python {sys.version_info[:2]}".encode())
    for library in NUMERICAL_LIBRARIES:
        digest.update(f" {library} {importlib.metadata.version(library)}".encode())
    for name, file in sorted({pair for room in rooms for pair in _source_files(room)}):
        tree = _without_docstrings(ast.parse(file.read_bytes()))
        digest.update(f"\n{name}\n{ast.dump(tree)}".encode())
    return digest.hexdigest()


def key(stage: str, inputs: Mapping[str, Any], rooms: tuple[str, ...]) -> str:
    """Name of a stage's result: hexadecimal, the same on every run with equal inputs and code."""
    text = json.dumps([stage, canonical(inputs), code_version(rooms)], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def _source_files(room: str) -> list[tuple[str, Path]]:
    if room == "__main__":
        file = getattr(sys.modules[room], "__file__", None)
        if file is None:
            raise TypeError(
                "a stage must be defined in a file: code that was typed in cannot be recognised on the next run"
            )
        return [(room, Path(file))]
    spec = importlib.util.find_spec(room)
    if spec is None:
        raise ModuleNotFoundError(f"a stage depends on the room {room!r}, which does not exist")
    folders = [Path(folder) for folder in spec.submodule_search_locations or ()]
    if folders:
        return [(f"{room}/{file.relative_to(folder)}", file) for folder in folders for file in folder.rglob("*.py")]
    return [(room, Path(spec.origin))] if spec.origin else []


def _without_docstrings(tree: ast.Module) -> ast.Module:
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and ast.get_docstring(
            node, clean=False
        ):
            node.body = node.body[1:]
    return tree


def _name(kind: type) -> str:
    return f"{kind.__module__}.{kind.__qualname__}"
