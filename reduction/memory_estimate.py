r"""Estimate the memory of a reduction before it is allocated.

The size of the factor does not follow directly from the size of the problem. A body is divided into levels: the
neighbours of one end, their neighbours, and so on. With w degrees of freedom per level and n in total, nested
dissection gives a factor of about

.. math:: n_L = c \, n \, w^{3/4}

entries (George 1973: n log n in the plane, n^(4/3) in a cube, where w = n^(2/3); the power and c are fitted to blades,
cubes and plates of bricks and tetrahedra with 14,000 to 113,000 degrees of freedom). `benchmarks/memory_estimate.py`
compares the estimate with measured peaks.
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
    """Bytes per entry of the stiffness for its copies, and whether the allocator keeps the memory of freed copies."""

    entry: float
    stay: bool


#: Factor within which measured peaks agree with the estimate, in both directions.
FACTOR = 1.5
#: Constant c: entries of the factor over n w^(3/4).
FILL = 2.6
#: Bytes per entry of the factor, by the name of the back end: the entry, and a quarter of it for work arrays. SuperLU
#: stores both triangles with their indices.
FACTOR_BYTES = {"pardiso": 10.0, "cholmod": 10.0, "superlu": 20.0}
#: Bytes per entry of the stiffness (both triangles counted) for copies during the factorisation: half of the interior
#: part; for a SciPy matrix the whole matrix, its blocks and its upper triangle; if single directions are removed,
#: SciPy's matrices in any case, and the blocks that PARDISO searches for.
COMPACT_COPY, CSR_COPY, SINGLE_COPY = _Copies(6.0, False), _Copies(12.0, True), _Copies(25.0, True)
#: Columns of the length of the system: blocks of work arrays of Lanczos' method in addition to its basis; at the end,
#: columns per boundary degree of freedom, for its constraint mode and arrays of the solver.
WORK_BLOCKS, PER_BOUNDARY = 9.0, 2.5
#: Bytes per entry of the stiffness for the reordered half matrix during CHOLMOD's factorisation; copies whose memory
#: the allocator does not keep are freed before.
CHOLMOD_COPY = 6.0
#: Memory of the libraries of the solver, and of the compiler of the compiled solutions and products [byte].
LIBRARIES, COMPILER = 5e7, 8e7
#: Bytes per entry of the stiffness for mass and stiffness of `fe.assembly.assemble_compact`.
SYSTEM_ENTRY = 5.6
#: Bytes per entry of the stiffness for mass and stiffness as SciPy's matrices.
CSR_SYSTEM = 16.0

#: Values for tetrahedra of ten nodes: degrees of freedom in a cube of their size (60 to 80 if fTetWild makes smaller
#: cells than requested), levels along an edge, entries in a row.
DOFS_PER_CUBE, LEVELS_PER_CELL, TET10_ROW = 40.0, 2.0, 78.0


def estimate_reduction_memory(matrix: Symmetric, n_boundary: int, n_mode: int, *, is_compact: bool = True) -> float:
    """Memory of a reduction in addition to the system [byte].

    Parameters
    ----------
    matrix
        Stiffness of the system, shape (n, n).
    n_boundary, n_mode
        Numbers of retained degrees of freedom, and of fixed-interface modes [-].
    is_compact
        Whether all degrees of freedom of a node are retained or none, so that one triangle of the matrix suffices.
    """
    if isinstance(matrix, UpperBlocks):
        n_entry, width, copies = matrix.nnz, NODE * _measure_level_width(matrix.graph()), COMPACT_COPY
    else:
        whole = matrix.tocsr()
        n_entry, width, copies = whole.nnz, _measure_level_width(whole), CSR_COPY
    return _estimate_bytes(matrix.shape[0], n_entry, width, n_boundary, n_mode, copies if is_compact else SINGLE_COPY)


def estimate_mesh_memory(mesh: Mesh, n_boundary: int, n_mode: int, *, is_compact: bool = True) -> float:
    """Memory of assembly and reduction of a mesh together, estimated without assembly [byte].

    Parameters
    ----------
    mesh
        The mesh.
    n_boundary, n_mode
        As in `estimate_reduction_memory` [-].
    is_compact
        Whether only nodes of the mesh are retained, in all directions, and no stations between nodes.
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
    """Lower estimate of the memory for a solid in tetrahedra of ten nodes, before it is meshed [byte].

    Parameters
    ----------
    volume, longest
        Volume of the solid, and longest side of the box around it [m^3, m].
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
    """Refuse a computation that needs more than the free memory.

    Parameters
    ----------
    needed
        Memory estimated by the functions of this module [byte].
    what
        Beginning of the message, such as "reducing 300000 degrees of freedom".

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
    """Memory of mass and stiffness; matrices in other coordinates are stored in addition to those of the nodes."""
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
    """Mean number of rows per level, starting from one end of the body."""
    n_row = graph.shape[0]
    last = np.zeros(1, dtype=np.int64)
    for _ in range(2):  # the row farthest from any row is an end
        n_level, last, seen = _count_levels(graph, last[:1])
    # Parts that are not connected to the first have their own levels.
    return float((seen if seen > n_row / 2 else n_row) / n_level)


def _count_levels(graph: sp.csr_array, front: Int[Whole, " k"]) -> tuple[int, Int[Whole, " k"], int]:
    """Number of levels starting from a row, rows of the last level, and number of rows in all levels."""
    seen = np.zeros(graph.shape[0], dtype=bool)
    n_level, last = 0, front
    while front.size:
        seen[front] = True
        n_level, last = n_level + 1, front
        near = np.zeros_like(seen)
        near[graph[front].indices] = True
        front = np.flatnonzero(near & ~seen)
    return n_level, last, int(seen.sum())
