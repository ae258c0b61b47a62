"""Matrices that Abaqus writes for ``*MATRIX OUTPUT``: node, direction, node, direction and value in each line.

Both nodes have directions 1 to 6, three displacements and three rotations. A symmetric matrix stores each pair once::

    **  Assembled nodes
    1,1, 1,1, 2.0000000e+04
    2,1, 1,1,-1.0000000e+04

References
----------
Abaqus Analysis User's Guide, Generating structural matrices; Abaqus Keywords Reference Guide, *MATRIX INPUT.
"""

import re
import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fe.errors import MatrixFileError
from fe.file.dof_table import DIRECTIONS, LARGEST_LABEL, DofLabels
from fe.file.matrix import MATRIX_FORMATS
from fe.file.matrix_content import FileMatrix, refuse_truncated_number
from fe.file.registry import FileFormat

#: Smallest diagonal entry of a degree of freedom that ``*BOUNDARY`` fixes: Abaqus writes 1e36, and no stiffness of a
#: structure reaches this value.
HELD = 1e30
_ENTRY = re.compile(rb"^[ \t]*\d+[ \t]*,[ \t]*\d+[ \t]*,[ \t]*\d+[ \t]*,[ \t]*\d+[ \t]*,[^,\n]+$", re.MULTILINE)


def read_matrix_output(path: Path) -> Mapping[str, FileMatrix]:
    """Read one symmetric matrix on the degrees of freedom that the file names.

    Raises
    ------
    MatrixFileError
        A line that cannot be read, a repeated entry, a degree of freedom other than displacements and rotations, or a
        degree of freedom that a boundary condition fixes.
    """
    refuse_truncated_number(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of NumPy, for an empty file, which is refused below
            table = np.loadtxt(path, dtype=np.float64, delimiter=",", comments="*", ndmin=2)
        places = table[:, :4]
        # Labels are read as real numbers: an invalid one is nan, 1.7 or too large; internal nodes of elements are
        # negative.
        if table.shape[1] != 5 or not ((places % 1 == 0) & (places >= 1) & (places <= LARGEST_LABEL)).all():
            raise ValueError
        first, first_dof, second, second_dof = places.T.astype(np.int64)
    except (ValueError, LookupError):
        raise MatrixFileError(
            f'"{path}" is not a matrix of Abaqus, or damaged: write it with *MATRIX OUTPUT, in lines of node, degree '
            "of freedom, node, degree of freedom and value"
        ) from None
    highest = int(max(first_dof.max(), second_dof.max()))
    if highest > len(DIRECTIONS):
        raise MatrixFileError(
            f'"{path}" has the degree of freedom {highest}: remove all degrees of freedom except displacements and '
            f"rotations, 1 to {len(DIRECTIONS)}, from the model"
        )
    width = len(DIRECTIONS)
    keys, index = np.unique(
        np.stack([width * first + first_dof - 1, width * second + second_dof - 1]), return_inverse=True
    )
    rows, columns = index.reshape(2, -1)
    dofs = DofLabels(node=keys // width, direction=keys % width)
    place, mirrored = rows * len(keys) + columns, columns * len(keys) + rows
    if len(np.unique(place)) < len(place):
        raise MatrixFileError(f'"{path}" gives an entry twice: write it again')
    # The stored triangle follows Abaqus' order of nodes, which may differ from the order of their labels.
    alone = ~np.isin(mirrored, place)
    entries = np.concatenate([table[:, 4], table[alone, 4]])
    both = (np.concatenate([rows, columns[alone]]), np.concatenate([columns, rows[alone]]))
    matrix = sp.csr_array(sp.coo_array((entries, both), shape=(len(keys),) * 2))
    held = np.flatnonzero(matrix.diagonal() >= HELD)
    if len(held):
        raise MatrixFileError(
            f'"{path}": {dofs.name(int(held[0]))} is fixed by 1e36, the value that Abaqus writes for *BOUNDARY: write '
            "the matrices in a step without it, and fix nodes by [[structure.support]]"
        )
    return {"": FileMatrix(matrix=matrix, dofs=dofs)}


MATRIX_FORMATS.register(
    FileFormat(
        name="matrix_output",
        suffixes=(".mtx",),
        recognise=lambda head: _ENTRY.search(head) is not None,
        read=read_matrix_output,
        write=None,
    )
)
