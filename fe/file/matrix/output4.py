"""Matrices in Nastran OUTPUT4 files, text or binary, column by column.

Each matrix has a heading (columns, rows, form, type, name), then one record per column: column, first row, number of
words, and the values. A first row of 0 means strings of non-zeros. Each string has a heading: length and row
("bigmat", with a negative number of rows), or both packed into one number, 65536 (length + 1) + row. A record beyond
the last column ends the matrix.

References
----------
MSC Nastran Quick Reference Guide, OUTPUT4; DMAP Programmer's Guide, OUTPUT4.
"""

import re
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fe.errors import MatrixFileError
from fe.file.matrix import MATRIX_FORMATS
from fe.file.matrix_content import FileMatrix, columns, fill_both_triangles, read_reals, refuse_size
from fe.file.registry import FileFormat

_PACKED = 65536
_SYMMETRIC = 6
_HEADING = 24  # bytes
#: Bytes of a value by real type; the other types are complex.
_REAL = {1: 4, 2: 8}
_WIDTH = re.compile(r"[ED](\d+)\.", re.IGNORECASE)

#: First row, column, and values of a string of consecutive rows.
String = tuple[int, int, np.ndarray]


def read_output4(path: Path) -> Mapping[str, FileMatrix]:
    """Read all real matrices of a file, by name.

    Raises
    ------
    MatrixFileError
        A complex matrix, or a file that is damaged or of another kind.
    """
    raw = path.read_bytes()
    try:
        result = _read_binary(path, raw) if _is_binary(raw) else _read_text(path, raw.decode("ascii").splitlines())
        return {name: FileMatrix(matrix=matrix) for name, matrix in result}
    except MatrixFileError:
        raise
    except (ValueError, LookupError, struct.error, StopIteration, RuntimeError):
        raise MatrixFileError(
            f'"{path}" ({len(raw)} bytes) is truncated, damaged or not an OUTPUT4 file of 32-bit words: write it '
            "again, preferably as text (FORM=FORMATTED)"
        ) from None


def _is_binary(head: bytes) -> bool:
    return head[:4] in (struct.pack("<i", _HEADING), struct.pack(">i", _HEADING))


def _assemble(path: Path, name: str, heading: tuple[int, int, int, int], strings: list[String]) -> sp.csr_array:
    n_column, n_row, form, kind = heading
    if kind not in _REAL:
        raise MatrixFileError(f'"{path}": {name} is complex (type {kind}): give losses as a damping matrix')
    for announced in (n_row, n_column):
        refuse_size(path, announced)
    rows = [np.arange(row, row + len(values)) for row, _, values in strings]
    cols = [np.full(len(values), column) for _, column, values in strings]
    data = [values for _, _, values in strings]
    place = (np.concatenate([[], *rows]).astype(np.int64), np.concatenate([[], *cols]).astype(np.int64))
    matrix = sp.csr_array(sp.coo_array((np.concatenate([[], *data]), place), shape=(abs(n_row), n_column)))
    matrix.eliminate_zeros()
    return fill_both_triangles(matrix) if form == _SYMMETRIC else matrix


def _read_text(path: Path, lines: list[str]) -> Iterator[tuple[str, sp.csr_array]]:
    at = 0
    while at < len(lines):
        if not lines[at].strip():
            at += 1
            continue
        heading = tuple(int(lines[at][start : start + 8]) for start in (0, 8, 16, 24))
        name, layout = lines[at][32:40].strip(), _WIDTH.search(lines[at][40:])
        width = int(layout.group(1)) if layout else 16
        at += 1
        strings: list[String] = []
        column = 0
        while True:
            numbers = [int(item) for item in lines[at].split()]
            at += 1
            if len(numbers) == 3:
                column, row = numbers[0] - 1, numbers[1] - 1
            elif len(numbers) == 2:
                row = numbers[1] - 1
            else:
                row = numbers[0] % _PACKED - 1
            if column >= heading[0]:
                at += 1  # the only value of the end record has no meaning
                break
            begin = at
            # Headings contain whole numbers only; each value has a decimal point.
            while at < len(lines) and "." in lines[at]:
                at += 1
            if at > begin:
                strings.append((row, column, read_reals(columns(lines[begin:at], width))))
        yield name, _assemble(path, name, (heading[0], heading[1], heading[2], heading[3]), strings)


def _read_binary(path: Path, raw: bytes) -> Iterator[tuple[str, sp.csr_array]]:
    order = "<" if struct.unpack("<i", raw[:4])[0] == _HEADING else ">"
    records = _split_records(raw, order)
    for record in records:
        heading = struct.unpack(f"{order}4i", record[:16])
        name = record[16:24].decode("ascii").strip()
        n_column, n_row, _, kind = heading
        value = np.dtype(f"{order}f{_REAL.get(kind, 8)}")
        strings: list[String] = []
        while True:
            content = next(records)
            column, row, _ = struct.unpack(f"{order}3i", content[:12])
            if column > n_column:
                break
            data = content[12:]
            if row:
                strings.append((row - 1, column - 1, np.frombuffer(data, dtype=value).astype(np.float64)))
                continue
            while data:
                if n_row < 0:
                    words, row = struct.unpack(f"{order}2i", data[:8])
                    words, data = words - 1, data[8:]
                else:
                    (packed,) = struct.unpack(f"{order}i", data[:4])
                    words, row, data = packed // _PACKED - 1, packed % _PACKED, data[4:]
                if words <= 0:
                    raise ValueError(words)
                result = np.frombuffer(data[: 4 * words], dtype=value).astype(np.float64)
                strings.append((row - 1, column - 1, result))
                data = data[4 * words :]
        yield name, _assemble(path, name, heading, strings)


def _split_records(raw: bytes, order: str) -> Iterator[bytes]:
    """Contents of Fortran records; the length of each is stored before and after it."""
    at = 0
    while at < len(raw):
        (length,) = struct.unpack(f"{order}i", raw[at : at + 4])
        (again,) = struct.unpack(f"{order}i", raw[at + 4 + length : at + 8 + length])
        if length != again:
            raise ValueError(length)
        yield raw[at + 4 : at + 4 + length]
        at += 8 + length


MATRIX_FORMATS.register(
    FileFormat(
        name="output4",
        suffixes=(".op4",),
        recognise=lambda head: _is_binary(head) or _WIDTH.search(head[:80].decode("latin-1")) is not None,
        read=read_output4,
        write=None,
    )
)
