"""Read variables of MATLAB files of versions 5 to 7, element by element.

SciPy's reader does not check counts in the file: a wrong count ends the process with a segmentation fault. Here every
count is compared with the available bytes, and the checksum of a compressed variable with its content.
"""

import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

HEADER = 128
NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
ENCODINGS = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
MATRIX, COMPRESSED = 14, 15
CELL, STRUCT, OBJECT, CHAR, SPARSE, FIRST_NUMBER, LAST_NUMBER = 1, 2, 3, 4, 5, 6, 15
OTHER = {16: "a function", 17: "an object", 18: "an object"}
IS_COMPLEX = 0x800
DEEPEST = 30


class MatlabFileError(ValueError):
    """Error for a damaged MATLAB file, with a message as the end of a sentence."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MatlabValue:
    """Value of a variable, of an element of a cell or of a field of a structure.

    Parameters
    ----------
    name
        Name of a variable; empty for other values.
    shape
        Lengths of the axes.
    numbers
        Numbers, shape `shape`.
    texts
        Rows of a matrix of characters.
    elements
        Elements of a cell in MATLAB's order.
    records
        Structures in MATLAB's order, each with its values by field.
    sparse
        Sparse matrix, shape `shape`.
    other
        Description of a value of any other kind.
    """

    name: str
    shape: tuple[int, ...]
    numbers: NDArray[Any] | None = None
    texts: list[str] | None = None
    elements: list["MatlabValue"] | None = None
    records: list[dict[str, "MatlabValue"]] | None = None
    sparse: sp.csc_array | None = None
    other: str = ""

    @property
    def content(self) -> Any:
        """Numbers, sparse matrix, text, list of texts, elements or records, unchanged; else `other`."""
        if self.numbers is not None:
            return self.numbers
        if self.sparse is not None:
            return self.sparse
        if self.texts is not None:
            return self.texts[0] if len(self.texts) == 1 else self.texts
        if self.elements is not None:
            return self.elements
        return self.other if self.records is None else self.records

    @property
    def simplified(self) -> Any:
        """Content with arrays of one element replaced by plain values, at any depth."""
        if self.numbers is not None:
            return self.numbers.item() if self.numbers.size == 1 else np.squeeze(self.numbers)
        if self.elements is not None:
            return [element.simplified for element in self.elements]
        if self.records is not None:
            records = [{name: value.simplified for name, value in record.items()} for record in self.records]
            return records[0] if len(records) == 1 else records
        return self.content


@dataclass(kw_only=True)
class _Elements:
    """Reader of consecutive elements in bytes."""

    data: bytes
    order: str
    depth: int
    position: int = field(default=0)

    def next(self) -> tuple[int, bytes]:
        """Type and content of the next element."""
        start = self.position
        if start + 8 > len(self.data):
            raise MatlabFileError(f"an element is missing at byte {start} of a variable")
        kind, size = np.frombuffer(self.data, f"{self.order}u4", 2, start).tolist()
        if kind >> 16:  # a small element has its content in the tag
            kind, size, begin = kind & 0xFFFF, kind >> 16, start + 4
            self.position = start + 8
            if size > 4:
                raise MatlabFileError(f"a small element says that it has {size} bytes")
        else:
            begin = start + 8
            self.position = min(len(self.data), begin + size + -size % 8)
        if begin + size > len(self.data):
            raise MatlabFileError(f"an element needs {size} bytes, {len(self.data) - begin} are left")
        return kind, self.data[begin : begin + size]

    def numbers(self) -> NDArray[Any]:
        """Numbers of the next element."""
        kind, content = self.next()
        if kind not in NUMBERS:
            raise MatlabFileError(f"numbers are of the unknown type {kind}")
        layout = np.dtype(self.order + NUMBERS[kind])
        if len(content) % layout.itemsize:
            raise MatlabFileError(f"{len(content)} bytes are no whole number of values of {layout.itemsize} bytes")
        return np.frombuffer(content, layout)

    def value(self) -> MatlabValue:
        """Value of the next element."""
        kind, content = self.next()
        if kind != MATRIX:
            raise MatlabFileError(f"an element of type {kind} stands where a value should")
        if not content:
            return MatlabValue(name="", shape=(0, 0), numbers=np.zeros((0, 0)))
        return _read_value(_Elements(data=content, order=self.order, depth=self.depth + 1))


def read_variables(data: bytes) -> Iterator[MatlabValue]:
    """Read the variables of a file.

    Raises
    ------
    MatlabFileError
        The file is damaged or truncated.
    """
    order = {b"IM": "<", b"MI": ">"}.get(data[126:HEADER])
    if order is None:
        raise MatlabFileError(f"bytes 127 and 128 are {data[126:HEADER]!r}, not the byte order IM or MI")
    position, number = HEADER, 0
    while position < len(data):
        number += 1
        if position + 8 > len(data):
            raise MatlabFileError(f"it is cut in variable {number} at byte {position}")
        kind, size = np.frombuffer(data, f"{order}u4", 2, position).tolist()
        content = data[position + 8 : position + 8 + size]
        if len(content) < size:
            raise MatlabFileError(
                f"it is cut: variable {number} at byte {position} needs {size} bytes, {len(content)} are left"
            )
        try:
            if kind == COMPRESSED:
                whole = zlib.decompress(content)
            elif kind == MATRIX:
                whole = data[position : position + 8 + size]
            else:
                raise MatlabFileError(f"type {kind} is no variable")
            yield _Elements(data=whole, order=order, depth=0).value()
        except (zlib.error, MatlabFileError, UnicodeError) as error:
            raise MatlabFileError(f"variable {number} at byte {position}: {error}") from None
        position += 8 + size


def _read_value(elements: _Elements) -> MatlabValue:
    if elements.depth > DEEPEST:
        raise MatlabFileError(f"values are more than {DEEPEST} deep within each other")
    flags = elements.numbers()
    if len(flags) < 1:
        raise MatlabFileError("a value has no class")
    kind, is_complex = int(flags[0]) & 0xFF, bool(int(flags[0]) & IS_COMPLEX)
    if kind == 17:  # the format of MATLAB's own classes is not documented
        return MatlabValue(name="", shape=(), other=OTHER[kind])
    shape = tuple(int(length) for length in elements.numbers())
    if len(shape) < 2 or any(length < 0 for length in shape):
        raise MatlabFileError(f"a value has the impossible shape {shape}")
    name = elements.next()[1].decode("utf-8", "replace")
    count = int(np.prod(shape, dtype=object))
    if kind == CELL:
        return MatlabValue(name=name, shape=shape, elements=_read_values(elements, count))
    if kind in {STRUCT, OBJECT}:
        if kind == OBJECT:
            elements.next()
        return MatlabValue(name=name, shape=shape, records=_read_records(elements, count))
    if kind == CHAR:
        return MatlabValue(name=name, shape=shape, texts=_read_texts(elements, shape, count))
    if FIRST_NUMBER <= kind <= LAST_NUMBER:
        return MatlabValue(name=name, shape=shape, numbers=_read_numbers(elements, shape, count, is_complex))
    if kind == SPARSE:
        return MatlabValue(name=name, shape=shape, sparse=_read_sparse(elements, shape, is_complex))
    if kind in OTHER:
        return MatlabValue(name=name, shape=shape, other=OTHER[kind])
    raise MatlabFileError(f"a value is of the unknown class {kind}")


def _read_numbers(elements: _Elements, shape: tuple[int, ...], count: int, is_complex: bool) -> NDArray[Any]:
    parts = [elements.numbers() for _ in range(1 + is_complex)]
    for part in parts:
        if len(part) != count:
            raise MatlabFileError(f"an array of shape {shape} has {len(part)} values")
    if elements.position < len(elements.data):
        raise MatlabFileError(f"an array of shape {shape} has more values than it says")
    values = parts[0] + 1j * parts[1] if is_complex else parts[0]
    return values.reshape(shape, order="F")


def _read_sparse(elements: _Elements, shape: tuple[int, ...], is_complex: bool) -> sp.csc_array:
    rows, starts = (elements.numbers().astype(np.int64) for _ in range(2))
    if len(shape) != 2 or len(starts) != shape[1] + 1:
        raise MatlabFileError(f"a sparse matrix of shape {shape} has {len(starts)} starts of columns")
    # MATLAB may store more places than it uses.
    used = int(starts[-1])
    parts = [elements.numbers()[:used] for _ in range(1 + is_complex)]
    inside = starts[0] == 0 and (np.diff(starts) >= 0).all() and ((rows[:used] >= 0) & (rows[:used] < shape[0])).all()
    if not inside or any(len(part) != used for part in (rows[:used], *parts)):
        raise MatlabFileError(f"a sparse matrix of shape {shape} has rows or values that are not there")
    values = parts[0] + 1j * parts[1] if is_complex else parts[0]
    return sp.csc_array((values.astype(values.dtype.newbyteorder("=")), rows[:used], starts), shape=shape)


def _read_texts(elements: _Elements, shape: tuple[int, ...], count: int) -> list[str]:
    kind, content = elements.next()
    if kind not in ENCODINGS:
        raise MatlabFileError(f"a text is of the unknown type {kind}")
    suffix = {"<": "-le", ">": "-be"}[elements.order] if ENCODINGS[kind] in {"utf-16", "utf-32"} else ""
    text = content.decode(ENCODINGS[kind] + suffix, "replace")
    if len(text) != count or len(shape) != 2:
        return [text.rstrip()]  # characters of several code units
    return [text[row :: shape[0]].rstrip() for row in range(shape[0])]


def _read_values(elements: _Elements, count: int) -> list[MatlabValue]:
    if 8 * count > len(elements.data):
        raise MatlabFileError(f"{count} values cannot be in {len(elements.data)} bytes")
    return [elements.value() for _ in range(count)]


def _read_records(elements: _Elements, count: int) -> list[dict[str, MatlabValue]]:
    length = elements.numbers()
    content = elements.next()[1]
    size = int(length[0]) if len(length) else 0
    if size <= 0 or len(content) % size:
        raise MatlabFileError(f"{len(content)} bytes are no names of fields of {size} bytes")
    names = [content[start : start + size].split(b"\0")[0] for start in range(0, len(content), size)]
    fields = [name.decode("utf-8", "replace") for name in names]
    values = _read_values(elements, count * len(fields))
    return [
        dict(zip(fields, values[start : start + len(fields)], strict=True))
        for start in range(0, count * len(fields), max(1, len(fields)))
    ]
