"""Several bodies as one mesh."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from fe.errors import MeshError
from fe.mesh import Mesh


def join_meshes(meshes: Mapping[str, Mesh]) -> Mesh:
    """Several bodies as one mesh, its nodes and cells in their order.

    Parameters
    ----------
    meshes
        By body.

    Returns
    -------
    A mesh with one cell set a body; its other sets are called "body.set".

    Raises
    ------
    MeshError
        Cells of several types: they are numbered type by type, so that those of a body would not stay together.
    """
    kinds = sorted({cell_type for mesh in meshes.values() for cell_type in mesh.cells})
    if len(kinds) != 1:
        raise MeshError(f"cells of the types {', '.join(kinds)} do not make one mesh: mesh all bodies with one element")
    (kind,) = kinds
    cells: list[NDArray[np.int64]] = []
    node_sets: dict[str, NDArray[np.int64]] = {}
    face_sets: dict[str, NDArray[np.int64]] = {}
    cell_sets: dict[str, NDArray[np.int64]] = {}
    node = cell = 0
    for body, mesh in meshes.items():
        cells.append(mesh.cells[kind] + node)
        node_sets |= {f"{body}.{name}": nodes + node for name, nodes in mesh.node_sets.items()}
        face_sets |= {f"{body}.{name}": faces + np.array([cell, 0]) for name, faces in mesh.face_sets.items()}
        cell_sets[body] = cell + np.arange(mesh.n_cell)
        node += mesh.n_node
        cell += mesh.n_cell
    return Mesh(
        points=np.concatenate([mesh.points for mesh in meshes.values()]),
        cells={kind: np.concatenate(cells)},
        node_sets=node_sets,
        face_sets=face_sets,
        cell_sets=cell_sets,
    )
