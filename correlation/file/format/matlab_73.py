"""MATLAB files of version 7.3 (`save -v7.3`): HDF5 with MATLAB classes as attributes and cells as references."""

from pathlib import Path
from typing import Any

import numpy as np

from correlation.file.arrays.collection import Collection, split_listed_units
from correlation.file.arrays.hdf5_tree import Hdf5Tree
from correlation.file.column import MeasuredFile
from correlation.file.format import MEASURED_FILES, MeasuredFileFormat
from correlation.file.format.matlab_5 import format_matlab_index, list_element_indices

#: Groups in which MATLAB stores the targets of references.
HIDDEN = ("#refs#", "#subsystem#")
DEEPEST = 30


def recognise(head: bytes) -> bool:
    """Whether a file has the header of version 7.3."""
    return head.startswith(b"MATLAB 7.3 MAT-file")


def read(path: Path) -> MeasuredFile:
    """Read numbers as columns named as in MATLAB; the file has the axes of arrays in the opposite order."""
    with Hdf5Tree(path) as tree:
        collection = Collection()
        for key, node in tree.children(tree.root, "", collection.facts):
            if key not in HIDDEN:
                _add(collection, tree, node, key, {}, "", 0)
        return MeasuredFile(path=path, format="matlab 7.3", columns=collection.columns, facts=collection.facts)


def _add(
    collection: Collection, tree: Hdf5Tree, node: Any, name: str, facts: dict[str, str], unit: str, depth: int
) -> None:
    """Add columns of a variable, a field or an element of a cell; facts and unit are those of its structure."""
    import h5py

    kind = node.attrs.get("MATLAB_class", b"")
    kind = kind.decode("ascii", "replace") if isinstance(kind, bytes) else str(kind)
    if depth > DEEPEST:
        collection.facts[name] = "not read: too many structures within each other"
    elif "MATLAB_sparse" in node.attrs:
        collection.facts[name] = "not read: a sparse matrix"
    elif tree.is_group(node):
        _add_fields(collection, tree, node, name, depth)
    elif node.attrs.get("MATLAB_empty", 0):
        collection.facts[name] = "empty"
    elif h5py.check_ref_dtype(node.dtype) is not None:
        brackets = "{}" if kind == "cell" else "()"
        _add_references(collection, tree, node, name, brackets, "", depth)
    elif kind == "char":
        collection.add_words(name, _read_texts(node), facts)
    else:
        values = tree.values(node, name)
        if isinstance(values, np.ndarray) and values.dtype.kind in "biufc":
            collection.add(name, values.T, format_matlab_index, facts, unit=unit)
        else:
            collection.facts[name] = values if isinstance(values, str) else f"not read: values of class {kind}"


def _add_fields(collection: Collection, tree: Hdf5Tree, group: Any, name: str, depth: int) -> None:
    """Add the fields of a structure or of an array of structures, whose fields are arrays of references."""
    import h5py

    fields = list(tree.children(group, name, collection.facts))
    texts = {
        key: text
        for key, field in fields
        if not tree.is_group(field) and field.attrs.get("MATLAB_class") == b"char" and "MATLAB_empty" not in field.attrs
        for text in _read_texts(field)[:1]
    }
    units = split_listed_units(texts, [key for key, _ in fields if key not in texts])
    for key, field in fields:
        is_array = not tree.is_group(field) and "MATLAB_class" not in field.attrs
        if is_array and h5py.check_ref_dtype(field.dtype) is not None:
            _add_references(collection, tree, field, name, "()", f".{key}", depth)
        else:
            _add(collection, tree, field, f"{name}.{key}", texts, units.get(key, ""), depth + 1)


def _add_references(
    collection: Collection, tree: Hdf5Tree, node: Any, name: str, brackets: str, suffix: str, depth: int
) -> None:
    """Add the targets of an array of references."""
    references = np.asarray(node[()]).T
    for index, reference in zip(list_element_indices(references.shape), references.reshape(-1, order="F"), strict=True):
        whole = f"{name}{brackets[0]}{index}{brackets[1]}{suffix}"
        try:
            target = tree.root[reference] if reference else None
        except (ValueError, KeyError) as error:
            raise tree.damaged(error, whole) from None
        if target is None:
            collection.facts[whole] = "empty"
        else:
            _add(collection, tree, target, whole, {}, "", depth + 1)


def _read_texts(node: Any) -> list[str]:
    """Rows of a matrix of characters."""
    codes = np.asarray(node[()])
    if codes.dtype.kind not in "ui":
        return []
    rows = np.atleast_2d(codes.T)
    return ["".join(chr(code) if code < 0x110000 else "?" for code in row).rstrip() for row in rows.tolist()]


MEASURED_FILES.register(
    MeasuredFileFormat(
        name="matlab 7.3",
        holds="a MATLAB file of version 7.3 (.mat)",
        suffixes=(".mat",),
        recognise=recognise,
        read=read,
    )
)
