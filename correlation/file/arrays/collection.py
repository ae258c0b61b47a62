"""Collection of the content of a file of nested arrays: numbers become columns, texts become facts."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from correlation.file.column import Column, make_unique_names
from correlation.file.unit_label import read_unit, split_label

#: Largest number of columns of an array; a larger array is a picture or a matrix of a model, not a set of channels.
MOST_COLUMNS = 4096
UNIT_KEYS = ("unit", "units", "unit_string", "unitstring", "ni_unitdescription")
Index = Callable[[tuple[int | None, ...]], str]


class Collection:
    """Columns and facts of a file, in the order of the file."""

    def __init__(self) -> None:
        self._columns: list[Column] = []
        self.facts: dict[str, str] = {}

    @property
    def columns(self) -> tuple[Column, ...]:
        """Columns with unique names."""
        names = make_unique_names([column.name for column in self._columns])
        return tuple(
            Column(**{**vars(column), "name": name}) for name, column in zip(names, self._columns, strict=True)
        )

    def add(self, name: str, values: NDArray[Any], index: Index, facts: Mapping[str, str], *, unit: str = "") -> None:
        """Add the columns of an array of numbers, one for each index of its short axes.

        Parameters
        ----------
        name
            Path of the array.
        values
            Numbers of any shape.
        index
            Function that formats an index, with None for the longest axis.
        facts
            Facts of the array.
        unit
            Label of its unit.
        """
        if values.size == 0:
            self.facts[name] = f"empty, {_shape(values)}"
            return
        number = values.size // max(values.shape, default=1)
        if number > MOST_COLUMNS:
            self.facts[name] = f"not read: {_shape(values)} are too many columns"
            return
        kind = np.complex128 if np.iscomplexobj(values) else np.float64
        text = read_unit(unit, name=name) or split_label(name)[1]
        for suffix, part in split_array(values, index):
            self._columns.append(
                Column(
                    name=name + suffix, values=part.astype(kind), unit=text, unit_label=unit, facts=facts, where=name
                )
            )

    def add_words(self, name: str, words: list[str], facts: Mapping[str, str]) -> None:
        """Add a column of text; a single text becomes a fact."""
        if len(words) <= 1:
            self.facts[name] = words[0] if words else "empty"
            return
        known = {word: number for number, word in enumerate(dict.fromkeys(words))}
        codes = np.array([known[word] for word in words], dtype=np.float64)
        self._columns.append(Column(name=name, values=codes, words=tuple(known), facts=facts, where=name))


def split_array(values: NDArray[Any], index: Index) -> Iterator[tuple[str, NDArray[Any]]]:
    """Vectors along the longest axis of an array, each with the text of its index."""
    if values.size == max(values.shape, default=1):
        yield "", values.reshape(-1)
        return
    axis = int(np.argmax(values.shape))
    others = tuple(size for number, size in enumerate(values.shape) if number != axis)
    for place in np.ndindex(*others):
        whole: tuple[int | None, ...] = (*place[:axis], None, *place[axis:])
        yield index(whole), values[tuple(slice(None) if one is None else one for one in whole)]


def split_listed_units(texts: Mapping[str, str], fields: Sequence[str]) -> dict[str, str]:
    """Units of the fields of a structure whose field "units" lists them all: "Hz, N, m/s^2, rad"."""
    units = [part.strip() for part in unit_label(texts).split(",")]
    return dict(zip(fields, units, strict=True)) if len(units) == len(fields) else {}


def unit_label(facts: Mapping[str, str]) -> str:
    """Label of the unit among attributes; empty if there is none."""
    lower = {key.lower(): text for key, text in facts.items()}
    return next((lower[key] for key in UNIT_KEYS if key in lower), "")


def _shape(values: NDArray[Any]) -> str:
    return " x ".join(map(str, values.shape)) or "a scalar"
