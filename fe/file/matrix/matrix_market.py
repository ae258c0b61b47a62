"""MatrixMarket files of SciPy and ANSYS (``*EXPORT,name,MMF``).

The heading names the layout, the type of numbers and the symmetry; then come comments, a line of sizes, and a line for
each entry::

    %%MatrixMarket matrix coordinate real symmetric
    3 3 4
    1 1 2.0
    ...

``coordinate`` lists row, column and value of each entry, ``array`` the values of all columns one below the other. A
symmetric matrix stores its lower triangle. SciPy's reader is not used because it reads missing values of an array as
zeros, adds the triangles of a symmetric matrix that stores both, and ends the program on some damaged numbers.

References
----------
Boisvert, Pozo and Remington, The Matrix Market Exchange Formats, NISTIR 5935 (1996).
"""

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from numpy.typing import NDArray

from fe.errors import MatrixFileError
from fe.file.matrix import MATRIX_FORMATS
from fe.file.matrix_content import FileMatrix, fill_both_triangles, refuse_size, refuse_truncated_number
from fe.file.registry import FileFormat

_BANNER = b"%%matrixmarket"
#: Types of numbers and symmetries that are accepted for a stiffness or mass.
_FIELDS, _SYMMETRIES = {"real", "double", "integer"}, {"general", "symmetric"}
#: Largest number of bytes of a heading, which has five words.
_HEADING = 1024


def read_matrix_market(path: Path) -> Mapping[str, FileMatrix]:
    """Read one real matrix.

    Raises
    ------
    MatrixFileError
        A complex matrix, entries without values, or a file that is damaged or of another kind.
    """
    try:
        refuse_truncated_number(path)
        with path.open("rb") as stream:
            layout, symmetry = _read_heading(path, stream)
            sizes = _read_sizes(path, stream, 3 if layout == "coordinate" else 2)
            for rows in sizes[:2]:
                refuse_size(path, rows)
            table = _read_numbers(path, stream, columns=3 if layout == "coordinate" else 1)
    except OSError as error:
        raise MatrixFileError(f'"{path}" cannot be read ({error.strerror}): check its permissions') from None
    if layout == "coordinate":
        matrix = _make_from_entries(path, table, sizes)
    else:
        matrix = _make_from_columns(path, table[:, 0], (sizes[0], sizes[1]), symmetry)
    return {"": FileMatrix(matrix=fill_both_triangles(matrix) if symmetry == "symmetric" else matrix)}


def _read_heading(path: Path, stream: BinaryIO) -> tuple[str, str]:
    words = stream.readline(_HEADING).decode("latin-1").lower().split()
    if len(words) != 5 or words[0].encode() != _BANNER or words[1] != "matrix":
        raise MatrixFileError(
            f'"{path}" is not a MatrixMarket file, or damaged: its first line must describe the content'
        )
    layout, field, symmetry = words[2:]
    if field == "pattern":
        raise MatrixFileError(f'"{path}" contains entries without values (pattern): write it as real')
    if field == "complex":
        raise MatrixFileError(f'"{path}" holds complex numbers: give a real matrix, and losses as a damping matrix')
    if layout not in {"coordinate", "array"} or field not in _FIELDS or symmetry not in _SYMMETRIES:
        raise MatrixFileError(
            f'"{path}" is {layout} {field} {symmetry}: write it as coordinate or array, real, general or symmetric'
        )
    return layout, symmetry


def _read_sizes(path: Path, stream: BinaryIO, count: int) -> list[int]:
    for line in stream:
        text = line.partition(b"%")[0].split()
        if text:
            if len(text) == count and all(len(word) < 20 and word.isdigit() for word in text):
                return [int(word) for word in text]
            break
    raise _make_damage_error(path, f"its line of sizes must hold {count} whole numbers")


def _read_numbers(path: Path, stream: BinaryIO, columns: int) -> Float[NDArray[np.float64], "line column"]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of NumPy, for no lines of numbers
            table = np.loadtxt(stream, dtype=np.float64, comments="%", ndmin=2)
    except ValueError as error:
        raise _make_damage_error(path, " ".join(str(error).split())) from None
    if len(table) and table.shape[1] != columns:
        raise _make_damage_error(path, f"its lines hold {table.shape[1]} numbers instead of {columns}")
    return table.reshape(-1, columns)


def _make_from_entries(path: Path, table: Float[NDArray[np.float64], "entry 3"], sizes: list[int]) -> sp.csr_array:
    n_row, n_column, n_entry = sizes
    if len(table) != n_entry:
        raise _make_damage_error(path, f"it announces {n_entry} entries but contains {len(table)}")
    place = table[:, :2]
    if not ((place % 1 == 0) & (place >= 1) & (place <= (n_row, n_column))).all():
        raise _make_damage_error(path, f"it has entries outside its {n_row} x {n_column} matrix")
    rows, columns = place.T.astype(np.int64) - 1
    matrix = sp.csr_array(sp.coo_array((table[:, 2], (rows, columns)), shape=(n_row, n_column)))
    if matrix.nnz != n_entry:
        raise _make_damage_error(path, "it gives an entry twice")
    return matrix


def _make_from_columns(
    path: Path, values: Float[NDArray[np.float64], " value"], shape: tuple[int, int], symmetry: str
) -> sp.csr_array:
    n_row, n_column = shape
    if symmetry == "symmetric" and n_row != n_column:
        raise _make_damage_error(path, f"its {n_row} x {n_column} matrix cannot be symmetric")
    count = n_row * (n_row + 1) // 2 if symmetry == "symmetric" else n_row * n_column
    if len(values) != count:
        raise _make_damage_error(
            path, f"its {n_row} x {n_column} matrix needs {count} values but it contains {len(values)}"
        )
    if symmetry == "general":
        return sp.csr_array(values.reshape(n_column, n_row).T)
    matrix = np.zeros(shape)
    matrix[np.triu_indices(n_row)[::-1]] = values  # column by column of the lower triangle
    return sp.csr_array(matrix)


def _make_damage_error(path: Path, reason: str) -> MatrixFileError:
    return MatrixFileError(f'"{path}" is not a MatrixMarket file, or damaged ({reason}): write it again')


MATRIX_FORMATS.register(
    FileFormat(
        name="matrix_market",
        suffixes=(".mtx", ".mmf"),
        recognise=lambda head: head.startswith(b"%%MatrixMarket"),
        read=read_matrix_market,
        write=None,
    )
)
