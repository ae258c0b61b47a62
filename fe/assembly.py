"""Vectorised assembly of the sparse mass and stiffness of a mesh."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from numpy.typing import NDArray

from fe.allocator import give_back
from fe.element import ELEMENTS, Element
from fe.errors import MeshError
from fe.material import Material
from fe.mesh import Mesh
from fe.solid import DIRECTIONS, element_blocks

#: Cells integrated at once: enough to amortise numpy's calls, few enough that their matrices stay in the cache.
BATCH = 64
#: Node pairs whose values are interleaved at once: 600 kB.
INTERLEAVED = 8192


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
    keys, sums = [], []
    for element, nodes, number in _batches(mesh):
        blocks, mass = element_blocks(element, mesh.points[nodes], lame[number], shear[number], density[number], number)
        key, values = _summed(nodes, mesh.n_node, [*blocks, mass])
        keys.append(key)
        sums.append(values)
    key = np.concatenate(keys)
    # The batches' keys are sorted already, and a stable sort merges sorted stretches in no time.
    order = np.argsort(key, kind="stable")
    key = key[order]
    is_new = np.concatenate([[True], key[1:] != key[:-1]])
    place = np.empty(len(key), dtype=np.int64)
    place[order] = np.cumsum(is_new) - 1
    pattern = key[is_new]
    row_start = np.searchsorted(pattern, np.arange(mesh.n_node + 1) * mesh.n_node).astype(np.int32)
    column = (pattern % mesh.n_node).astype(np.int32)
    node_shape = (mesh.n_node, mesh.n_node)
    mirror = sp.csr_array((np.arange(len(pattern)), column, row_start), shape=node_shape).T.tocsr().data
    stiffness = np.empty((9, len(pattern)))
    for k, (i, j) in enumerate(DIRECTIONS):
        block = np.bincount(place, np.concatenate([values[k] for values in sums]))
        # Round-off alone separates the triangles; their mean makes the assembled matrix symmetric to the last bit.
        stiffness[3 * i + j] = (block + block[mirror]) / 2 if i == j else block
        if i != j:
            stiffness[3 * j + i] = block[mirror]
    node_mass = np.bincount(place, np.concatenate([values[-1] for values in sums]))
    node_mass = (node_mass + node_mass[mirror]) / 2
    size = (3 * mesh.n_node, 3 * mesh.n_node)
    stiffness_matrix = sp.csr_array(sp.bsr_array((_interleaved(stiffness), column, row_start), shape=size))
    del keys, sums, key, order, place, mirror, stiffness
    give_back()
    return _same_in_each_direction(node_mass, column, row_start), stiffness_matrix


def _summed(
    nodes: Int[NDArray[np.int64], "cell node"],
    n_node: int,
    blocks: Sequence[Float[NDArray[np.float64], "cell node node"]],
) -> tuple[Int[NDArray[np.int64], " pair"], list[Float[NDArray[np.float64], " pair"]]]:
    """Blocks of a batch summed over its cells: sorted keys a * n_node + b of the node pairs, and their values."""
    # Numbered within the batch, all pairs fit into one table: a look-up each, where sorting them would take longest.
    used, local = np.unique(nodes, return_inverse=True)
    local = local.reshape(nodes.shape).astype(np.int32)
    pair = (local[:, :, None] * len(used) + local[:, None, :]).ravel()
    exists = np.zeros(len(used) ** 2, dtype=bool)
    exists[pair] = True
    present = np.flatnonzero(exists)
    table = np.empty(len(exists), dtype=np.int32)
    table[present] = np.arange(len(present), dtype=np.int32)
    place = table[pair]
    row, column = np.divmod(present, len(used))
    sums = [np.asarray(np.bincount(place, block.ravel(), len(present)), dtype=np.float64) for block in blocks]
    return used[row] * n_node + used[column], sums


def _interleaved(blocks: Float[NDArray[np.float64], "9 pair"]) -> Float[NDArray[np.float64], "pair 3 3"]:
    """The nine values of each pair side by side; piece by piece in the cache, three times as fast as at once."""
    result = np.empty((blocks.shape[1], 9))
    for first in range(0, len(result), INTERLEAVED):
        result[first : first + INTERLEAVED] = blocks[:, first : first + INTERLEAVED].T
    return result.reshape(-1, 3, 3)


def _same_in_each_direction(
    values: Float[NDArray[np.float64], " k"],
    column: Int[NDArray[np.int32], " k"],
    row_start: Int[NDArray[np.int32], " rows"],
) -> sp.csr_array:
    """Node matrix kron I_3: each row three times, its columns moved apart."""
    n = len(row_start) - 1
    length = np.repeat(np.diff(row_start), 3)
    start = np.concatenate([[0], np.cumsum(length)]).astype(np.int32)
    source = np.arange(start[-1], dtype=np.int32) - np.repeat(start[:-1] - np.repeat(row_start[:-1], 3), length)
    direction = np.repeat(np.tile(np.arange(3, dtype=np.int32), n), length)
    return sp.csr_array((values[source], 3 * column[source] + direction, start), shape=(3 * n, 3 * n))


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
