"""Craig-Bampton reduction of a linear system."""

from collections.abc import Iterator, Mapping

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float

from fe.allocator import return_freed_memory
from fe.blas_threads import on_one_blas_thread
from fe.errors import SupportError
from fe.modal import find_lowest_eigenpairs
from fe.sparse.block_lanczos import COLUMNS_PER_MODE
from fe.sparse.node_matrix import BlockProduct
from fe.sparse.solver import Factor, SingularMatrix, factorise
from fe.sparse.symmetric_part import take_rows
from fe.system import LinearSystem
from reduction.array_type import Matrix, Real, Vector, Whole
from reduction.errors import RomError
from reduction.partition import Partition, Rows, partition, take_interior_part
from reduction.rom import ReducedModel

#: Number of columns that are moved before their memory is freed.
AT_ONCE = 16
#: Right-hand sides that are solved at once: size of a group, smallest and largest number of groups, and memory limit
#: [byte]; the solution and the arrays of the solver need this memory again.
GROUP, LEAST, MOST, MEMORY = 24, 1, 3, 1.5e8


@on_one_blas_thread
def craig_bampton(
    system: LinearSystem, boundary: Mapping[str, Rows], n_mode: int = 150, provenance: Mapping[str, str] | None = None
) -> ReducedModel:
    r"""Reduce a system to its boundary degrees of freedom and its lowest fixed-interface modes.

    .. math::
        T = \begin{bmatrix} I & 0 \\ \Psi & \Phi \end{bmatrix}, \quad
        K_r = \begin{bmatrix} K_{bb} + K_{bi} \Psi & 0 \\ 0 & \Omega^2 \end{bmatrix}, \quad
        M_r = \begin{bmatrix} T_b^T M T_b & P^T \Phi \\ \Phi^T P & I \end{bmatrix}, \quad
        C_r = T^T C T

    with constraint modes Psi, fixed-interface modes Phi (mass-normalised, squared frequencies Omega^2), the boundary
    columns T_b of T and the interior rows P of M T_b. Statically the model is exact at the boundary; each of its
    frequencies is at least as high as that of the full model with the same number.

    Parameters
    ----------
    system
        Full model; its stiffness may be singular if fixing the boundary fixes the interior.
    boundary
        Rows of the system by set name, each of shape (k,) [-], as returned by `LinearSystem.rows`. Sets may overlap.
    n_mode
        Number of fixed-interface modes to keep [-]; a number above that of the interior keeps all, which gives the full
        model in other coordinates. 0 is static (Guyan) condensation.
    provenance
        Origin of the model, stored in the model and its file.

    Raises
    ------
    RomError
        A boundary set that is empty, fixed or unknown; a negative n_mode; a boundary that does not fix the interior; or
        neither boundary nor modes.

    References
    ----------
    Craig and Bampton, Coupling of substructures for dynamic analyses, AIAA Journal 6 (1968) 1313-1319.
    """
    if n_mode < 0:
        raise RomError(f"n_mode = {n_mode} fixed-interface modes must not be negative: 150 is a usual value")
    rows = partition(system, boundary)
    n_boundary = len(rows.boundary)
    n_mode = min(n_mode, len(rows.interior))
    if n_boundary + n_mode == 0:
        raise RomError(
            "a reduced model without boundary and without modes is empty: name a boundary set or retain modes"
        )
    on_boundary = take_rows(system.stiffness, rows.boundary)
    recovery, lambda_ = _compute_basis(system, rows, on_boundary, n_mode)
    return ReducedModel(
        mass=_reduce_mass(system, rows, recovery),
        damping=_reduce_damping(system, recovery),
        stiffness=_reduce_stiffness(on_boundary, recovery, lambda_),
        boundary_node=system.free[rows.boundary] // 3,
        boundary_direction=system.free[rows.boundary] % 3,
        boundary_sets=rows.boundary_sets,
        fixed_interface_frequency=np.sqrt(lambda_) / (2 * np.pi),
        recovery=recovery,
        free=system.free,
        n_node=system.n_node,
        provenance=provenance or {},
    )


def _compute_basis(
    system: LinearSystem, rows: Partition, on_boundary: sp.csr_array, n_mode: int
) -> tuple[Matrix, Vector]:
    """Basis T on the rows of the system, and eigenvalues of the fixed-interface modes [rad^2/s^2]."""
    b, i, n_boundary = rows.boundary, rows.interior, len(rows.boundary)
    # In column order, as the shapes are computed; memory pages that are not yet used cost nothing.
    recovery = np.zeros((system.n_dof, n_boundary + n_mode), order="F")
    lambda_ = np.zeros(0)
    if len(i):
        mass, stiffness = (take_interior_part(item, i) for item in (system.mass, system.stiffness))
        try:
            factor = factorise(stiffness, n_column=COLUMNS_PER_MODE * n_mode + n_boundary)
            return_freed_memory()
            if n_mode:
                lambda_, shapes = find_lowest_eigenpairs(stiffness, mass, n_mode, factor)
                _move(shapes, recovery[:, n_boundary:], i)
        except (SingularMatrix, SupportError) as error:
            raise RomError(
                f"the {len(i)} interior degrees of freedom can still move as a rigid body while the boundary is "
                "fixed: add supports, or boundary degrees of freedom at three nodes that are not on one line"
            ) from error
        for block, shapes in compute_constraint_modes(factor, on_boundary[:, i]):
            recovery[i, block] = shapes
    recovery[b, np.arange(n_boundary)] = 1.0
    return recovery, lambda_


def compute_constraint_modes(
    factor: Factor, stiffness_boundary_interior: sp.csr_array
) -> Iterator[tuple[slice, Float[Real, "i k"]]]:
    r"""Interior displacement for a unit displacement of each boundary degree of freedom, without interior forces.

    .. math:: \Psi = -K_{ii}^{-1} K_{ib}

    `factor` is the factor of K_ii, the matrix is K_bi = K_ib^T, shape (b, i) [N/m]. Yields groups of boundary degrees
    of freedom, 24 to 72 depending on memory, and their columns of Psi, shape (i, k) [-], which are valid until the next
    group. Together with unit displacements of the boundary, the columns reproduce every rigid-body motion.

    References
    ----------
    Craig and Bampton, Coupling of substructures for dynamic analyses, AIAA Journal 6 (1968), eq. 5.
    """
    n_boundary, n_interior = stiffness_boundary_interior.shape
    width = GROUP * int(np.clip(MEMORY / (8 * GROUP * n_interior), LEAST, MOST))
    place = np.empty((0, 0))
    for first in range(0, n_boundary, width):
        block = slice(first, min(first + width, n_boundary))
        forces = stiffness_boundary_interior[block].toarray().T
        if place.shape != forces.shape:
            place = np.empty(forces.shape, order="F")
        solution = factor.solve(forces, place)
        yield block, np.negative(solution, out=solution)


def _move(source: Matrix, target: Matrix, rows: Whole) -> None:
    """Move columns into rows of a target, the last columns first, and free their memory on the way."""
    # If columns are contiguous in memory, the last ones can be cut off.
    n_row, n_column = source.shape
    is_cut = source.flags.f_contiguous and source.flags.owndata
    for first in reversed(range(0, n_column, AT_ONCE)):
        for k in range(first, min(first + AT_ONCE, n_column)):
            target[rows, k] = source[:, k]
        if is_cut:
            source.resize((n_row, first), refcheck=False)


def _reduce_mass(system: LinearSystem, rows: Partition, recovery: Matrix) -> Matrix:
    n_boundary, n_reduced = len(rows.boundary), recovery.shape[1]
    carried = BlockProduct(system.mass) @ recovery[:, :n_boundary]
    mass = np.eye(n_reduced)
    coupling = recovery[:, n_boundary:].T @ carried  # Phi is zero on the boundary: only P counts
    mass[:n_boundary, :n_boundary] = _symmetrise(recovery[:, :n_boundary].T @ carried)
    mass[n_boundary:, :n_boundary] = coupling
    mass[:n_boundary, n_boundary:] = coupling.T
    return mass


def _reduce_stiffness(on_boundary: sp.csr_array, recovery: Matrix, lambda_: Vector) -> Matrix:
    n_boundary, n_reduced = on_boundary.shape[0], recovery.shape[1]
    stiffness = np.zeros((n_reduced, n_reduced))
    # Rows of K on the boundary times T_b: K_bb + K_bi Psi.
    condensed = on_boundary @ recovery[:, :n_boundary]
    stiffness[:n_boundary, :n_boundary] = _symmetrise(condensed)
    modal = np.arange(n_boundary, n_reduced)
    stiffness[modal, modal] = lambda_
    return stiffness


def _reduce_damping(system: LinearSystem, recovery: Matrix) -> Matrix:
    if not system.damping.nnz:
        return np.zeros((recovery.shape[1],) * 2)
    return _symmetrise(recovery.T @ (system.damping @ recovery))


def _symmetrise(matrix: Matrix) -> Matrix:
    return np.asarray((matrix + matrix.T) / 2)
