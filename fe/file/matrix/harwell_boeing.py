"""Sparse matrices in Harwell-Boeing and Rutherford-Boeing files, such as those of ANSYS' HBMAT.

A heading of four lines gives the number of lines of each block, the type (``RSA`` is real, symmetric, assembled), the
numbers of rows, columns and entries, and the Fortran formats; a fifth line follows if there are right-hand sides. Then
come the starts of the columns, the rows and the values, in columns of fixed width. A symmetric matrix stores one
triangle.

References
----------
Duff, Grimes and Lewis, Users' Guide for the Harwell-Boeing Sparse Matrix Collection, TR/PA/92/86, CERFACS (1992).
"""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fe.errors import MatrixFileError
from fe.file.matrix import MATRIX_FORMATS
from fe.file.matrix_content import (
    FileMatrix,
    columns,
    fill_both_triangles,
    read_reals,
    refuse_size,
    refuse_truncated_number,
)
from fe.file.registry import FileFormat

_FORMAT = re.compile(r"\(\s*(?:\d*P\s*,?)?\s*\d*\s*[IEDFG]\s*(\d+)", re.IGNORECASE)


def read_harwell_boeing(path: Path) -> Mapping[str, FileMatrix]:
    """Read a real assembled matrix; both triangles of a symmetric matrix are filled.

    Raises
    ------
    MatrixFileError
        Another type of matrix, or a file that is damaged or of another kind.
    """
    try:
        lines = path.read_text(encoding="ascii").splitlines()
        counts = [int(item) for item in lines[1].split()]
        kind = lines[2][:3].upper()
        n_row, n_column, n_entry = (int(item) for item in lines[2][3:].split()[:3])
        widths = [int(width) for width in _FORMAT.findall(lines[3])]
        n_start, n_index, n_value = counts[1:4]
    except (UnicodeDecodeError, ValueError, LookupError):
        raise MatrixFileError(
            f'"{path}" has no Harwell-Boeing heading: write it with HBMAT in its ASCII form'
        ) from None
    _check_kind(path, kind)
    for announced in (n_row, n_column, n_entry):
        refuse_size(path, announced)
    first = 5 if len(counts) > 4 and counts[4] > 0 else 4
    blocks = np.cumsum([first, n_start, n_index, n_value])
    try:
        starts, rows = (
            np.array(
                [int(item) for item in _split_entries(lines[blocks[k] : blocks[k + 1]], widths[k], count)],
                dtype=np.int64,
            )
            - 1
            for k, count in ((0, n_column + 1), (1, n_entry))
        )
        values = read_reals(_split_entries(lines[blocks[2] : blocks[3]], widths[2], n_entry))
    except OverflowError:
        raise MatrixFileError(f'"{path}" holds a column start or a row beyond 64 bits: write it again') from None
    except (ValueError, LookupError) as error:
        raise MatrixFileError(f'"{path}" does not hold the numbers that its heading announces: {error}') from None
    expected = (n_column + 1, n_entry, n_entry)
    if (len(starts), len(rows), len(values)) != expected:
        raise MatrixFileError(
            f'"{path}" holds {len(starts)} column starts, {len(rows)} rows and {len(values)} values, but its heading '
            f"announces {expected[0]}, {n_entry} and {n_entry}: it is cut short, write it again"
        )
    refuse_truncated_number(path)
    inside = starts[0] == 0 and starts[-1] == n_entry and not (np.diff(starts) < 0).any()
    if not inside or (n_entry and not 0 <= rows.min() <= rows.max() < n_row):
        raise MatrixFileError(f'"{path}" has column starts or rows outside its {n_row} x {n_column} matrix')
    matrix = sp.csr_array(sp.csc_array((values, rows, starts), shape=(n_row, n_column)))
    return {"": FileMatrix(matrix=fill_both_triangles(matrix) if kind[1] == "S" else matrix)}


def _split_entries(lines: list[str], width: int, count: int) -> list[str]:
    """Entries of a block: split at blanks if that gives `count` (SciPy announces wrong widths), else by width."""
    parted = " ".join(lines).split()
    return parted if len(parted) == count else columns(lines, width)


def _check_kind(path: Path, kind: str) -> None:
    wrong = {
        "C": "complex numbers: give losses as a damping matrix", "P": "places without values",
        "Z": "a skew-symmetric matrix", "H": "a Hermitian matrix", "E": "matrices of single elements: assemble them",
    }  # fmt: skip
    for letter in kind:
        if letter in wrong:
            raise MatrixFileError(
                f'"{path}" is of type {kind}, {wrong[letter]}; real assembled matrices (RSA) are read'
            )
    if not re.fullmatch("[RI][SUR]A", kind):
        raise MatrixFileError(f'"{path}" is of the unknown type "{kind}": real assembled matrices (RSA) are read')


MATRIX_FORMATS.register(
    FileFormat(
        name="harwell_boeing",
        suffixes=(".hb", ".rb", ".matrix"),
        recognise=lambda head: _FORMAT.search(head.decode("latin-1")) is not None,
        read=read_harwell_boeing,
        write=None,
    )
)
