"""MATLAB files of versions 5 to 7 (`save -v6`, `save -v7`)."""

from pathlib import Path

import numpy as np

from correlation.errors import CampaignError
from correlation.file.arrays.collection import Collection, split_listed_units
from correlation.file.column import MeasuredFile
from correlation.file.format import MEASURED_FILES, MeasuredFileFormat
from reduction.file.matlab_elements import MatlabFileError, MatlabValue, read_variables


def recognise(head: bytes) -> bool:
    """Whether a file has the header of version 5."""
    return head.startswith(b"MATLAB 5.0 MAT-file")


def read(path: Path) -> MeasuredFile:
    """Read numbers as columns named as in MATLAB, such as ``FRF{1}.freq`` or ``run(2).acc(:,3)``, texts as facts."""
    data = path.read_bytes()
    if not data.startswith(b"MATLAB"):
        raise CampaignError(f"{path.name}: is not a MATLAB file of version 5 or later; save it by save -v7")
    collection = Collection()
    created = data[:116].decode("latin-1").partition("Created on:")[2].strip(" \0")
    if created:
        collection.facts["created"] = created
    try:
        for value in read_variables(data):
            _add(collection, value.name, value, {}, "")
    except MatlabFileError as error:
        raise CampaignError(f"{path.name}: is a damaged MATLAB file: {error}; save it again by save -v7") from None
    return MeasuredFile(path=path, format="matlab 5", columns=collection.columns, facts=collection.facts)


def _add(collection: Collection, name: str, value: MatlabValue, facts: dict[str, str], unit: str) -> None:
    """Add columns of a value and of its elements; facts and unit are those of the structure of which it is a field."""
    if value.numbers is not None:
        collection.add(name, value.numbers, format_matlab_index, facts, unit=unit)
    elif value.texts is not None:
        collection.add_words(name, value.texts, facts)
    elif value.elements is not None:
        for index, element in zip(list_element_indices(value.shape), value.elements, strict=True):
            _add(collection, f"{name}{{{index}}}", element, facts, unit)
    elif value.records is not None:
        for index, record in zip(list_element_indices(value.shape), value.records, strict=False):
            _add_fields(collection, name if len(value.records) == 1 else f"{name}({index})", record)
    else:
        collection.facts[name] = f"not read: {value.other or 'a sparse matrix'}"


def _add_fields(collection: Collection, name: str, record: dict[str, MatlabValue]) -> None:
    """Add the fields of one structure; its texts are facts of its columns."""
    texts = {field: value.texts[0] for field, value in record.items() if value.texts and len(value.texts) == 1}
    units = split_listed_units(texts, [field for field in record if field not in texts])
    for field, value in record.items():
        _add(collection, f"{name}.{field}", value, texts, units.get(field, ""))


def list_element_indices(shape: tuple[int, ...]) -> list[str]:
    """Indices of elements in MATLAB's order: one number for vectors, all for other arrays."""
    count = int(np.prod(shape))
    if count == max(shape, default=1):
        return [str(number + 1) for number in range(count)]
    return [",".join(str(one + 1) for one in place[::-1]) for place in np.ndindex(*shape[::-1])]


def format_matlab_index(place: tuple[int | None, ...]) -> str:
    """Index of a vector in MATLAB notation, such as (:,2)."""
    return f"({','.join(':' if one is None else str(one + 1) for one in place)})"


MEASURED_FILES.register(
    MeasuredFileFormat(
        name="matlab 5", holds="a MATLAB file (.mat)", suffixes=(".mat",), recognise=recognise, read=read
    )
)
