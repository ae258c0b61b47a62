"""Hexahedra cut into tetrahedra that fit their neighbours, whichever way the blocks beside them run."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Int
from numpy.typing import NDArray

from fe.element.hex8 import CORNER_FACES, CORNERS
from fe.element.tet10 import EDGES, FACES

#: Places of the 27 nodes of a cell in half-cell steps: corners, middles of edges and faces, centre.
LATTICE = np.array([(i, j, k) for i in range(3) for j in range(3) for k in range(3)])
#: Corners in those steps, in VTK order.
CORNER_PLACES = (CORNERS + 1).astype(np.int64)

Faces = Int[NDArray[np.int64], "_ 2"]


def split(
    cells: Int[NDArray[np.int64], "cell 27"], face_sets: Mapping[str, Faces]
) -> tuple[Int[NDArray[np.int64], "tetrahedron 10"], dict[str, Faces]]:
    """Six tetrahedra of ten nodes in place of each hexahedron.

    The corner of the lowest number is the apex of all six; their bases are the triangles of the three faces that it is
    not on. Each face is cut from its own corner of lowest number, so that both cells beside it cut it alike.

    Parameters
    ----------
    cells
        Node numbers at `LATTICE` of right-handed hexahedra.
    face_sets
        Cell number and side (x-, x+, y-, y+, z-, z+) by name.

    Returns
    -------
    The tetrahedra, six a hexahedron in the order of these, and the face sets on them.

    References
    ----------
    Dompierre et al., How to subdivide pyramids, prisms and hexahedra into tetrahedra, 8th Int. Meshing Roundtable
    (1999): the rule of the lowest number.
    """
    number = cells[:, _index(CORNER_PLACES)]
    apex = number.argmin(axis=1)
    owner, corners = [], []
    for face in np.array(CORNER_FACES):
        away = np.flatnonzero(~np.isin(apex, face))
        first = number[away][:, face].argmin(axis=1)
        turned = face[(first[:, None] + np.arange(4)) % 4]
        for triangle in ([0, 2, 1], [0, 3, 2]):
            owner.append(away)
            # Anticlockwise seen from the apex, that is from inside.
            corners.append(np.column_stack([turned[:, triangle], apex[away]]))
    order = np.argsort(np.concatenate(owner), kind="stable")
    cell = np.concatenate(owner)[order]
    places = CORNER_PLACES[np.concatenate(corners)[order]]
    middles = np.stack([(places[:, a] + places[:, b]) // 2 for a, b in EDGES], axis=1)
    nodes = cells[cell[:, None], _index(np.concatenate([places, middles], axis=1))]
    side = _sides(places)
    found = {}
    for name, faces in face_sets.items():
        wanted = np.isin(6 * cell[:, None] + side, 6 * faces[:, 0] + faces[:, 1]) & (side >= 0)
        found[name] = np.argwhere(wanted)
    return nodes, found


def _index(places: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.asarray(places @ np.array([9, 3, 1]))


def _sides(places: Int[NDArray[np.int64], "tetrahedron 4 3"]) -> Int[NDArray[np.int64], "tetrahedron 4"]:
    """The side of the hexahedron that each face of a tetrahedron lies on, -1 for none."""
    side = np.full((len(places), len(FACES)), -1)
    for local, face in enumerate(FACES):
        on = places[:, list(face[:3])]
        for axis in range(3):
            for end in (0, 1):
                side[(on[:, :, axis] == 2 * end).all(axis=1), local] = 2 * axis + end
    return side
