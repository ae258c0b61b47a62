"""Vectorised assembly of the sparse mass and stiffness of a mesh."""

from collections.abc import Iterator, Mapping

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.element import ELEMENTS, Element
from fe.errors import MeshError
from fe.material import Material
from fe.mesh import Mesh
from fe.solid import element_matrices

#: Cells integrated at once: enough to amortise numpy's calls, few enough to stay in the cache.
BATCH = 256


def assemble(mesh: Mesh, materials: Material | Mapping[str, Material]) -> tuple[sp.csr_array, sp.csr_array]:
    """Consistent mass and stiffness of a mesh on all its 3 n_node degrees of freedom, 3 * node + direction.

    Parameters
    ----------
    mesh
        The mesh.
    materials
        One material for all cells, or one for each cell set; the sets must then cover every cell exactly once.

    Returns
    -------
    Mass and stiffness, each a symmetric CSR array with both triangles, shape (3 n_node, 3 n_node) [kg, N/m].

    Raises
    ------
    MeshError
        No cells; a material for an unknown cell set; or a cell with no material or with two.
    InvertedCell
        A cell is turned inside out; the message has its number.
    """
    if not mesh.n_cell:
        raise MeshError("the mesh has no cells: nothing to assemble")
    lame, shear, density = cell_elasticity(mesh, materials)
    keys, blocks, masses = [], [], []
    for element, nodes, number in _batches(mesh):
        points = mesh.points[nodes]
        stiffness, mass = element_matrices(element, points, lame[number], shear[number], density[number], number)
        # Sum within the batch first: neighbours share most of their node pairs.
        pair = (nodes[:, :, None] * mesh.n_node + nodes[:, None, :]).ravel()
        unique, place = np.unique(pair, return_inverse=True)
        n = element.n_node
        node_blocks = stiffness.reshape(-1, n, 3, n, 3).transpose(2, 4, 0, 1, 3).reshape(9, -1)
        summed = np.stack([np.bincount(place, values, len(unique)) for values in node_blocks], axis=1)
        keys.append(unique)
        blocks.append(summed.reshape(-1, 3, 3))
        masses.append(np.bincount(place, mass.ravel(), len(unique)))
    pattern = np.unique(np.concatenate(keys))
    stiffness_blocks = np.zeros((len(pattern), 3, 3))
    node_mass = np.zeros(len(pattern))
    for unique, block, mass_values in zip(keys, blocks, masses, strict=True):
        place = np.searchsorted(pattern, unique)
        stiffness_blocks[place] += block
        node_mass[place] += mass_values
    row_start = np.searchsorted(pattern, np.arange(mesh.n_node + 1) * mesh.n_node).astype(np.int32)
    column = (pattern % mesh.n_node).astype(np.int32)
    size = 3 * mesh.n_node
    stiffness_matrix = sp.csr_array(sp.bsr_array((stiffness_blocks, column, row_start), shape=(size, size)))
    mass_matrix = _same_in_each_direction(node_mass, column, row_start)
    return mass_matrix, stiffness_matrix


def _same_in_each_direction(
    values: Float[NDArray[np.float64], " k"],
    column: Int[NDArray[np.int32], " k"],
    row_start: Int[NDArray[np.int32], " rows"],
) -> sp.csr_array:
    """Node matrix kron I_3."""
    n = len(row_start) - 1
    return sp.csr_array(sp.kron(sp.csr_array((values, column, row_start), shape=(n, n)), sp.eye_array(3), format="csr"))


def _batches(mesh: Mesh) -> Iterator[tuple[Element, NDArray[np.int64], NDArray[np.int64]]]:
    start = 0
    for cell_type, nodes in mesh.cells.items():
        for first in range(0, len(nodes), BATCH):
            batch = nodes[first : first + BATCH]
            yield ELEMENTS[cell_type], batch, np.arange(start + first, start + first + len(batch))
        start += len(nodes)


def cell_elasticity(mesh: Mesh, materials: Material | Mapping[str, Material]) -> Float[NDArray[np.float64], "3 cell"]:
    """First Lamé constant, shear modulus and density of every cell, shape (3, n_cell) [Pa, Pa, kg/m^3]."""
    if isinstance(materials, Material):
        materials, cell_sets = {"all": materials}, {"all": np.arange(mesh.n_cell)}
    else:
        cell_sets = dict(mesh.cell_sets)
    values = np.full((3, mesh.n_cell), np.nan)
    for name, material in materials.items():
        if name not in cell_sets:
            known = ", ".join(sorted(cell_sets)) or "none"
            raise MeshError(f'a material is given for the cell set "{name}", but the mesh has {known}')
        cells = cell_sets[name]
        taken = ~np.isnan(values[0, cells])
        if taken.any():
            raise MeshError(
                f'cell {cells[np.argmax(taken)]} has two materials: "{name}" shares it with another cell set; '
                "give every cell exactly one"
            )
        values[:, cells] = np.array([[material.lame], [material.shear], [material.density]])
    missing = np.flatnonzero(np.isnan(values[0]))
    if missing.size:
        raise MeshError(f"{len(missing)} cells have no material, the first is cell {missing[0]}: name their cell set")
    return values
