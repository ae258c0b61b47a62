"""Vectorised assembly of the sparse mass and stiffness of a mesh."""

from collections.abc import Iterator, Mapping

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.allocator import return_freed_memory
from fe.element import Element
from fe.errors import MeshError
from fe.material import Material
from fe.mesh import Mesh
from fe.solid import DIRECTIONS, compute_element_blocks
from fe.sparse.node_matrix import NodeMatrix
from fe.sparse.upper_blocks import UpperBlocks

#: Number of cells that are integrated at once: enough to amortise numpy's calls, and few enough for the cache.
BATCH = 64
#: Index of the block of two directions in `DIRECTIONS`.
NUMBER = {pair: k for k, pair in enumerate(DIRECTIONS)}
#: All pairs of directions, in the order of a block in memory.
DIRECTION_PAIRS = [(i, j) for i in range(3) for j in range(3)]


def assemble(mesh: Mesh, materials: Material | Mapping[str, Material]) -> tuple[sp.csr_array, sp.csr_array]:
    """Consistent mass and stiffness of a mesh as SciPy's matrices, in four times the memory of `assemble_compact`.

    Parameters and errors are those of `assemble_compact`.

    Returns
    -------
    Mass and stiffness, each a symmetric CSR array with both triangles, shape (3 n_node, 3 n_node) [kg, N/m].
    """
    mass, stiffness = assemble_compact(mesh, materials)
    return mass.tocsr(), stiffness.tocsr()


def assemble_compact(mesh: Mesh, materials: Material | Mapping[str, Material]) -> tuple[NodeMatrix, UpperBlocks]:
    """Consistent mass and stiffness of a mesh on all its 3 n_node degrees of freedom, 3 * node + direction.

    Parameters
    ----------
    mesh
        The mesh.
    materials
        One material for all cells, or one for each cell set; the sets must then cover every cell exactly once.

    Returns
    -------
    Mass, stored for one direction, and stiffness, stored as upper triangle, shape (3 n_node, 3 n_node) [kg, N/m].
    Supports, modes, reductions and `factorise` accept them; sums, slices and SciPy's solvers need `.tocsr()`.

    Raises
    ------
    MeshError
        No cells; a material for an unknown cell set; or a cell with no material or with two.
    InvertedCell
        An inverted cell; the message contains its number.
    """
    if not mesh.n_cell:
        raise MeshError("the mesh has no cells: nothing to assemble")
    lame, shear, density = list_cell_elasticity(mesh, materials)
    keys, sums = [], []
    for element, nodes, number in _split_batches(mesh):
        blocks, mass = compute_element_blocks(
            element, mesh.points[nodes], lame[number], shear[number], density[number], number
        )
        key, values = _sum_pairs(nodes, mesh.n_node, blocks, mass)
        keys.append(key)
        sums.append(values)
    # Nodes without cells get zeros on the diagonal, because every row of the upper triangle begins there.
    unused = np.setdiff1d(np.arange(mesh.n_node), np.concatenate([nodes.ravel() for nodes in mesh.cells.values()]))
    keys.append(unused * mesh.n_node + unused)
    sums.append([np.zeros(len(unused))] * (len(DIRECTION_PAIRS) + 1))
    key = np.concatenate(keys)
    # The keys of each batch are sorted already, so a stable sort is fast.
    order = np.argsort(key, kind="stable")
    key = key[order]
    is_new = np.concatenate([[True], key[1:] != key[:-1]])
    place = np.empty(len(key), dtype=np.int64)
    place[order] = np.cumsum(is_new) - 1
    pattern = key[is_new]
    row_start = np.searchsorted(pattern, np.arange(mesh.n_node + 1) * mesh.n_node).astype(np.int32)
    column = (pattern % mesh.n_node).astype(np.int32)
    stiffness = np.empty((len(pattern), len(DIRECTION_PAIRS)))
    for k in range(len(DIRECTION_PAIRS)):
        stiffness[:, k] = np.bincount(place, np.concatenate([values[k] for values in sums]))
    node_mass = np.bincount(place, np.concatenate([values[-1] for values in sums]))
    del keys, sums, key, order, place
    upper = sp.csr_array((node_mass, column, row_start), shape=(mesh.n_node, mesh.n_node))
    mass_matrix = NodeMatrix(nodes=sp.csr_array(upper + sp.triu(upper, 1).T))
    return_freed_memory()
    return mass_matrix, UpperBlocks(row_start=row_start, column=column, values=stiffness.reshape(-1, 3, 3))


def _sum_pairs(
    nodes: Int[NDArray[np.int64], "cell node"],
    n_node: int,
    blocks: Float[NDArray[np.float64], "6 cell node node"],
    mass: Float[NDArray[np.float64], "cell node node"],
) -> tuple[Int[NDArray[np.int64], " pair"], list[Float[NDArray[np.float64], " pair"]]]:
    """Sums over the cells of a batch for the node pairs a <= b: sorted keys a * n_node + b, nine stiffnesses, mass."""
    # With node numbers of the batch, all pairs fit into one table; sorting them would be slower.
    used, local = np.unique(nodes, return_inverse=True)
    local = local.reshape(nodes.shape).astype(np.int32)
    upper = np.flatnonzero(local[:, :, None] <= local[:, None, :])
    pair = (local[:, :, None] * len(used) + local[:, None, :]).ravel()[upper]
    exists = np.zeros(len(used) ** 2, dtype=bool)
    exists[pair] = True
    present = np.flatnonzero(exists)
    table = np.empty(len(exists), dtype=np.int32)
    table[present] = np.arange(len(present), dtype=np.int32)
    place = table[pair]
    row, column = np.divmod(present, len(used))
    # By symmetry, the three missing blocks are transposes of stored blocks.
    whole = [blocks[NUMBER[i, j]] if i <= j else blocks[NUMBER[j, i]].swapaxes(1, 2) for i, j in DIRECTION_PAIRS]
    sums = [
        np.asarray(np.bincount(place, item.ravel()[upper], len(present)), dtype=np.float64) for item in (*whole, mass)
    ]
    return used[row] * n_node + used[column], sums


def _split_batches(mesh: Mesh) -> Iterator[tuple[Element, NDArray[np.int64], NDArray[np.int64]]]:
    for start, element, nodes in mesh.blocks():
        for first in range(0, len(nodes), BATCH):
            batch = nodes[first : first + BATCH]
            yield element, batch, np.arange(start + first, start + first + len(batch))


def list_cell_elasticity(
    mesh: Mesh, materials: Material | Mapping[str, Material]
) -> Float[NDArray[np.float64], "3 cell"]:
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
