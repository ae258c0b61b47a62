"""HDF5 files: every array of numbers as columns, texts and attributes as facts."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from correlation.file.arrays.collection import Collection, unit_label
from correlation.file.arrays.hdf5_tree import Hdf5Tree
from correlation.file.column import MeasuredFile
from correlation.file.format import MEASURED_FILES, MeasuredFileFormat

SIGNATURE = b"\x89HDF\r\n\x1a\n"


def recognise(head: bytes) -> bool:
    """Whether a file has the signature of HDF5, at its beginning or after a user block."""
    return any(head[offset : offset + 8] == SIGNATURE for offset in (0, 512, 1024, 2048)) and not head.startswith(
        b"MATLAB"
    )


def read(path: Path) -> MeasuredFile:
    """Read columns, named by their paths in the file, such as ``run/acc[0]``."""
    with Hdf5Tree(path) as tree:
        collection = Collection()
        collection.facts |= tree.attributes(tree.root)
        _add_group(collection, tree, tree.root, "", {})
        return MeasuredFile(
            path=path, format="hdf5", title=collection.facts.get("title", ""), columns=collection.columns,
            facts=collection.facts,
        )  # fmt: skip


def _add_group(collection: Collection, tree: Hdf5Tree, group: Any, path: str, above: Mapping[str, str]) -> None:
    """Add the columns of a group and of its subgroups; the attributes of a group apply to all its members."""
    shared = {**above, **tree.attributes(group)} if path else {}
    for key, node in tree.children(group, path, collection.facts):
        name = f"{path}/{key}" if path else key
        if tree.is_group(node):
            _add_group(collection, tree, node, name, shared)
        else:
            _add_dataset(collection, tree, node, name, {**shared, **tree.attributes(node)})


def _add_dataset(collection: Collection, tree: Hdf5Tree, node: Any, name: str, facts: dict[str, str]) -> None:
    values, unit = tree.values(node, name), unit_label(tree.attributes(node))
    if isinstance(values, str):
        collection.facts[name] = values
    elif isinstance(values, list):
        collection.add_words(name, values, facts)
    elif values.dtype.names:
        for field in values.dtype.names:
            part = values[field]
            if part.dtype.kind in "biufc":
                collection.add(f"{name}/{field}", part, format_hdf5_index, facts, unit=unit)
            else:
                collection.facts[f"{name}/{field}"] = f"not read: values of type {part.dtype}"
    elif values.dtype.kind in "biufc":
        collection.add(name, values, format_hdf5_index, facts, unit=unit)
    else:
        collection.facts[name] = f"not read: values of type {values.dtype}"


def format_hdf5_index(place: tuple[int | None, ...]) -> str:
    """Index of a vector without its long axis: [0] in an array of two axes, [0,2] in an array of three."""
    return f"[{','.join(str(one) for one in place if one is not None)}]"


MEASURED_FILES.register(
    MeasuredFileFormat(
        name="hdf5",
        holds="an HDF5 file (.h5, .hdf5)",
        suffixes=(".h5", ".hdf5", ".hdf", ".he5", ".nc"),
        recognise=recognise,
        read=read,
    )
)
