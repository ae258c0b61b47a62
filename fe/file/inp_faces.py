"""The labels S1 to S6 that Abaqus and CalculiX decks give to the faces of a cell."""

import numpy as np
from jaxtyping import Int
from numpy.typing import NDArray

#: Local face of a hexahedron here (x-, x+, y-, y+, z-, z+) by its label there: S1 is 1-2-3-4, S2 5-8-7-6, S3 1-5-6-2,
#: S4 2-6-7-3, S5 3-7-8-4, S6 4-8-5-1 (CalculiX CrunchiX User's Manual 2.20, "Eight-node brick element").
HEXAHEDRON = {"S1": 4, "S2": 5, "S3": 2, "S4": 1, "S5": 3, "S6": 0}
#: Tetrahedra have the order of that manual here too: S1 is 1-2-3, S2 1-4-2, S3 2-4-3, S4 3-4-1.
TETRAHEDRON = {"S1": 0, "S2": 1, "S3": 2, "S4": 3}
FACE_OF_LABEL = {"hexahedron": HEXAHEDRON, "hexahedron20": HEXAHEDRON, "tetra10": TETRAHEDRON}
#: All labels, in the order of their numbers.
LABELS = tuple(HEXAHEDRON)


class UnknownFace(ValueError):
    """A cell that has no face of the label; the message says which."""


def faces_of_labels(
    cells: Int[NDArray[np.int64], " k"], labels: Int[NDArray[np.int64], " k"], block_of_cell: list[tuple[str, int]]
) -> Int[NDArray[np.int64], "k 2"]:
    """Cell and local face of each cell and place of a label in `LABELS`.

    Parameters
    ----------
    cells
        Cell numbers through all blocks, shape (k,) [-].
    labels
        Places of their labels, shape (k,) [-].
    block_of_cell
        Cell type and number of cells of each block; those of surfaces and lines keep the place of the label.

    Raises
    ------
    UnknownFace
        A tetrahedron with the label S5 or S6.
    """
    ends = np.cumsum([count for _, count in block_of_cell])
    block = np.searchsorted(ends, cells, side="right")
    local = labels.copy()
    for number, (cell_type, _) in enumerate(block_of_cell):
        here = np.flatnonzero(block == number)
        if cell_type in FACE_OF_LABEL and here.size:
            places = np.array([FACE_OF_LABEL[cell_type].get(label, -1) for label in LABELS])
            local[here] = places[labels[here]]
            if local[here].min() < 0:
                label = LABELS[labels[here][local[here].argmin()]]
                raise UnknownFace(f'names the face "{label}" of a {cell_type}, which has S1 to S4 only')
    return np.column_stack([cells, local])
