r"""What a reduction will take of the machine's memory, before it is taken.

The factor is the part that no shape of the problem tells at once. A body is a row of levels, the neighbours of
neighbours of one end; with w degrees of freedom in a level, n in all, nested dissection leaves about

.. math:: n_L = c \, n \, w^{3/4}

entries in it (George 1973: n log n in the plane, n^(4/3) in a cube, where w = n^(2/3); the power and c are fitted to
blades, cubes and plates of bricks and tetrahedra between 14,000 and 113,000). `benchmarks/memory_estimate.py` compares
the estimate with measured peaks.
"""

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from jaxtyping import Int

from fe.mesh import Mesh
from fe.sparse.block_lanczos import COLUMNS_PER_MODE, basis_columns, choose_block
from fe.sparse.factor import LONG, NODE, Symmetric
from fe.sparse.solver import Backend, choose_backend
from fe.sparse.upper_blocks import UpperBlocks
from reduction.array_type import Whole
from reduction.available_memory import read_available_memory
from reduction.errors import RomError


class _Copies(NamedTuple):
    """Bytes of an entry of the stiffness in copies of it, and whether the allocator keeps them once they are gone."""

    entry: float
    stay: bool


#: Measured peaks lie within this factor of the estimate, either way.
FACTOR = 1.5
#: Entries of the factor over n w^(3/4).
FILL = 2.6
#: Bytes of an entry of the factor, by the name of the back end: itself, and a quarter for work arrays. SuperLU keeps
#: both triangles with their indices.
FACTOR_BYTES = {"pardiso": 10.0, "cholmod": 10.0, "superlu": 20.0}
#: Bytes of an entry of the stiffness, both triangles counted, that stand beside the system while it is factorised: half
#: of the interior's part; of a SciPy matrix the whole, its blocks and its upper triangle; and where single directions
#: are cut out, SciPy's matrices in any case, and the blocks that PARDISO looks for.
COMPACT_COPY, CSR_COPY, SINGLE_COPY = _Copies(6.0, False), _Copies(12.0, True), _Copies(25.0, True)
#: Columns of the length of the system: work arrays of Lanczos' method beside its basis, in blocks; at the end, of a
#: boundary degree of freedom, its constraint mode with the solver's own arrays.
WORK_BLOCKS, PER_BOUNDARY = 9.0, 2.5
#: The same of the half that stands beside CHOLMOD's factor, in its order; copies that do not stay are gone by then.
CHOLMOD_COPY = 6.0
#: What the solver's libraries take once, and the compiler of our own solutions and products [byte].
LIBRARIES, COMPILER = 5e7, 8e7
#: Bytes of an entry of the stiffness in mass and stiffness as `fe.assembly.assemble_compact` makes them.
SYSTEM_ENTRY = 5.6
#: The same in SciPy's matrices.
CSR_SYSTEM = 16.0

#: Of tetrahedra of ten nodes: degrees of freedom in the cube of their size (60 to 80 where fTetWild makes smaller cells
#: than asked for), levels along an edge, entries in a row.
DOFS_PER_CUBE, LEVELS_PER_CELL, TET10_ROW = 40.0, 2.0, 78.0


def estimate_reduction_memory(matrix: Symmetric, n_boundary: int, n_mode: int, *, is_compact: bool = True) -> float:
    """Bytes that reducing a system takes beside the system itself.

    Parameters
    ----------
    matrix
        Stiffness of the system, shape (n, n).
    n_boundary, n_mode
        Number of degrees of freedom that are retained, and of fixed-interface modes [-].
    is_compact
        Whether the retained ones are all those of some nodes, so that a half-stored matrix stays one.
    """
    if isinstance(matrix, UpperBlocks):
        n_entry, width, copies = matrix.nnz, NODE * _measure_level_width(matrix.graph()), COMPACT_COPY
    else:
        whole = matrix.tocsr()
        n_entry, width, copies = whole.nnz, _measure_level_width(whole), CSR_COPY
    return _estimate_bytes(matrix.shape[0], n_entry, width, n_boundary, n_mode, copies if is_compact else SINGLE_COPY)


def estimate_mesh_memory(mesh: Mesh, n_boundary: int, n_mode: int, *, is_compact: bool = True) -> float:
    """Bytes that assembling and reducing a mesh take together, found without assembling it.

    Parameters
    ----------
    mesh
        The mesh.
    n_boundary, n_mode
        As in `estimate_reduction_memory` [-].
    is_compact
        Whether what is retained are nodes of the mesh, in all directions, and no stations between them.
    """
    ends, columns = [], []
    for cells in mesh.cells.values():
        ends.append(np.full(len(cells), cells.shape[1]))
        columns.append(cells.ravel())
    start = np.concatenate([[0], np.cumsum(np.concatenate(ends))])
    used = np.concatenate(columns)
    belongs = sp.csr_array((np.ones(len(used), dtype=np.int32), used, start), shape=(len(start) - 1, mesh.n_node))
    graph = sp.csr_array(belongs.T @ belongs)
    n_entry = NODE**2 * graph.nnz
    reduced = _estimate_bytes(
        NODE * mesh.n_node, n_entry, NODE * _measure_level_width(graph), n_boundary, n_mode, _choose_copies(is_compact)
    )
    return reduced + _estimate_system(n_entry, is_compact)


def estimate_tetrahedra_memory(
    volume: float, longest: float, size: float, n_boundary: int, n_mode: int, *, is_compact: bool = True
) -> float:
    """Bytes that a solid in tetrahedra of ten nodes takes at least, before there is a mesh.

    Parameters
    ----------
    volume, longest
        Volume of the solid, and the longest side of the box around it [m^3, m].
    size
        Size of the cells [m].
    n_boundary, n_mode
        As in `estimate_reduction_memory` [-].
    is_compact
        As in `estimate_mesh_memory`.
    """
    n_dof = DOFS_PER_CUBE * volume / size**3
    width = n_dof / max(1.0, LEVELS_PER_CELL * longest / size)
    n_entry = TET10_ROW * n_dof
    return _estimate_bytes(n_dof, n_entry, width, n_boundary, n_mode, _choose_copies(is_compact)) + _estimate_system(
        n_entry, is_compact
    )


def refuse_beyond_memory(needed: float, what: str) -> None:
    """Refuse what would not fit.

    Parameters
    ----------
    needed
        Memory, as the functions of this module estimate it [byte].
    what
        Beginning of the sentence, such as "reducing 300000 degrees of freedom".

    Raises
    ------
    RomError
        More memory than is free.
    """
    free = read_available_memory()
    if needed > free:
        raise RomError(
            f"{what} takes about {needed / 1e9:.3g} GB of memory, but {free / 1e9:.3g} GB are free: take larger "
            "elements, keep fewer modes or boundary degrees of freedom, or take a larger machine"
        )


def _estimate_system(n_entry: float, is_compact: bool) -> float:
    """Bytes of mass and stiffness; those in other coordinates stand beside those of the nodes."""
    return (SYSTEM_ENTRY + (0.0 if is_compact else CSR_SYSTEM)) * n_entry


def _choose_copies(is_compact: bool) -> _Copies:
    return COMPACT_COPY if is_compact else SINGLE_COPY


def _estimate_bytes(n_dof: float, n_entry: float, width: float, n_boundary: int, n_mode: int, copies: _Copies) -> float:
    filled = min(FILL * n_dof * float(width) ** 0.75, n_dof * (n_dof + 1) / 2)
    backend = choose_backend(int(n_dof), COLUMNS_PER_MODE * n_mode + n_boundary)
    factor = FACTOR_BYTES[backend.value] * filled
    block = choose_block(n_mode)
    in_lanczos = basis_columns(max(int(n_dof), 1), n_mode, block) + WORK_BLOCKS * block
    at_the_end = n_mode + PER_BOUNDARY * n_boundary
    columns = 8.0 * n_dof * max(in_lanczos, at_the_end)
    is_cholmod = backend is Backend.CHOLMOD
    entry = CHOLMOD_COPY + copies.entry * copies.stay if is_cholmod else copies.entry
    libraries = LIBRARIES + COMPILER * (is_cholmod or n_dof >= LONG)
    return float(libraries + factor + (entry * n_entry + columns if copies.stay else max(entry * n_entry, columns)))


def _measure_level_width(graph: sp.csr_array) -> float:
    """Mean number of rows in a level, seen from one end of the body."""
    n_row = graph.shape[0]
    last = np.zeros(1, dtype=np.int64)
    for _ in range(2):  # the farthest row from anywhere is an end
        n_level, last, seen = _count_levels(graph, last[:1])
    # Parts that nothing joins to the first have levels of their own.
    return float((seen if seen > n_row / 2 else n_row) / n_level)


def _count_levels(graph: sp.csr_array, front: Int[Whole, " k"]) -> tuple[int, Int[Whole, " k"], int]:
    """Number of levels from a row on, the last of them, and how many rows they hold."""
    seen = np.zeros(graph.shape[0], dtype=bool)
    n_level, last = 0, front
    while front.size:
        seen[front] = True
        n_level, last = n_level + 1, front
        near = np.zeros_like(seen)
        near[graph[front].indices] = True
        front = np.flatnonzero(near & ~seen)
    return n_level, last, int(seen.sum())
