"""Matrices that CalculiX writes for ``*FREQUENCY, SOLVER=MATRIXSTORAGE``: one triangle, one entry per line."""

import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fe.errors import MatrixFileError
from fe.file.dof_table import LARGEST_LABEL
from fe.file.matrix import MATRIX_FORMATS
from fe.file.matrix_content import FileMatrix, fill_both_triangles, refuse_size, refuse_truncated_number
from fe.file.registry import FileFormat


def read_calculix(path: Path) -> Mapping[str, FileMatrix]:
    """Read lines of row, column (from 1) and value.

    Raises
    ------
    MatrixFileError
        A line that cannot be read, or an empty file.
    """
    refuse_truncated_number(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of NumPy, for an empty file, which is refused below
            table = np.loadtxt(path, dtype=np.float64, ndmin=2)
        place = table[:, :2]
        # Rows and columns are read as real numbers: an invalid one is nan, 1.7, 0 or too large.
        if table.shape[1] != 3 or not ((place % 1 == 0) & (place >= 1) & (place <= LARGEST_LABEL)).all():
            raise ValueError
        rows, columns = place.T.astype(np.int64) - 1
    except (ValueError, LookupError):
        raise MatrixFileError(
            f'"{path}" is not a CalculiX matrix, or damaged: write it with *FREQUENCY, SOLVER=MATRIXSTORAGE'
        ) from None
    size = int(max(rows.max(), columns.max())) + 1
    refuse_size(path, size)
    matrix = sp.csr_array(sp.coo_array((table[:, 2], (rows, columns)), shape=(size, size)))
    return {"": FileMatrix(matrix=fill_both_triangles(matrix))}


MATRIX_FORMATS.register(
    FileFormat(
        name="calculix",
        suffixes=(".sti", ".mas"),
        recognise=lambda head: len(head.partition(b"\n")[0].split()) == 3,
        read=read_calculix,
        write=None,
    )
)
