"""Content of matrix files of other programs, and numbers in Fortran notation."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from numpy.typing import NDArray

from fe.errors import MatrixFileError
from fe.file.dof_table import DofLabels


@dataclass(frozen=True, kw_only=True, eq=False)
class FileMatrix:
    """Matrix of a file.

    Parameters
    ----------
    matrix
        Matrix, both triangles if it is symmetric, shape (n, n).
    dofs
        Degree of freedom of each row; None if the file does not name them.
    """

    matrix: sp.csr_array
    dofs: DofLabels | None = None


def check_real_matrix(path: Path, matrix: Any) -> FileMatrix:
    """Check that a matrix of SciPy or NumPy is real and has two dimensions.

    Raises
    ------
    MatrixFileError
        Numbers that are not real, or an array without two dimensions.
    """
    if len(matrix.shape) != 2:
        raise MatrixFileError(f'"{path}" holds an array of shape {matrix.shape}: it must be a square matrix')
    if matrix.dtype.kind not in "fiub":
        kind = "complex numbers" if matrix.dtype.kind == "c" else f"{matrix.dtype}"
        raise MatrixFileError(f'"{path}" holds {kind}: give a real matrix, and losses as a damping matrix')
    return FileMatrix(matrix=sp.csr_array(matrix, dtype=np.float64))


def fill_both_triangles(matrix: sp.csr_array) -> sp.csr_array:
    """Symmetric matrix from one of its triangles."""
    lower, upper = sp.tril(matrix, -1), sp.triu(matrix, 1)
    if lower.nnz and upper.nnz:
        # Some versions of ANSYS mark a matrix as symmetric but write both triangles.
        return matrix
    return sp.csr_array(matrix + (lower + upper).T)


def refuse_size(path: Path, rows: int) -> None:
    """Refuse a number of rows or columns that is too large for the file, before memory is allocated.

    Raises
    ------
    MatrixFileError
        The file has fewer bytes than rows or columns.
    """
    size = path.stat().st_size
    if abs(rows) > size:
        raise MatrixFileError(
            f'"{path}" announces {abs(rows)} rows or columns, but has {size} bytes: it is damaged, write it again'
        )


def refuse_truncated_number(path: Path) -> None:
    """Refuse a text file without a line end after its last line: its last number may be cut off.

    Raises
    ------
    MatrixFileError
        The line end is missing.
    """
    with path.open("rb") as stream:
        if stream.seek(0, 2) and stream.seek(-1, 2) >= 0 and stream.read() not in {b"\n", b"\r"}:
            raise MatrixFileError(
                f'"{path}" may be truncated within its last number, since its last line has no end: write it again'
            )


#: Exponent of three digits without its letter: "1.5-103" is 1.5e-103.
_BARE_EXPONENT = re.compile(r"(?<=[\d.])([+-]\d+)$")


def read_fortran_real(text: str) -> float:
    """Read a real number such as 1.5, 1.5D+03 or 1.5-103.

    Raises
    ------
    ValueError
        A text that is not a number.
    """
    plain = text.strip().upper().replace("D", "E")
    return float(plain if "E" in plain else _BARE_EXPONENT.sub(r"E\1", plain))


def columns(lines: list[str], width: int) -> list[str]:
    """Entries of lines in columns of fixed width, without blank entries."""
    result = []
    for line in lines:
        text = line.rstrip()
        result += [text[start : start + width] for start in range(0, len(text), width)]
    return [item for item in result if item.strip()]


def read_reals(entries: list[str]) -> Float[NDArray[np.float64], " n"]:
    """Real numbers from their texts; Python's conversion is tried first because it is fast."""
    try:
        return np.fromiter(map(float, entries), dtype=np.float64, count=len(entries))
    except ValueError:
        return np.fromiter(map(read_fortran_real, entries), dtype=np.float64, count=len(entries))
