"""Estimate errors of a reduced model without solving the full one: frequencies and fixed-interface modes."""

import numpy as np
import scipy.linalg
from jaxtyping import Float

from fe.blas_threads import on_one_blas_thread
from fe.dense_modes import compute_dense_modes
from fe.mode_check import ModeCheck, check_modes
from fe.sparse.factor import Symmetric
from fe.sparse.solver import UnknownInertia, factorise
from fe.sparse.symmetric_part import part
from fe.system import LinearSystem
from reduction.array_type import Matrix, Real, Vector, Whole
from reduction.errors import RomError
from reduction.rom import ReducedModel

#: Number of random start vectors, which find truncated modes that the motion of the boundary does not excite.
N_RANDOM = 4
#: Largest relative change of all estimates in the last step; the estimate gives the order of magnitude only.
CONVERGED = 0.1
#: Relative error below which an estimate is round-off of the sparse solve.
NEGLIGIBLE = 1e-12
#: Largest number of blocks of added shapes: each reduces the error by (lambda / omega_{m+1}^2)^2, so usually two or
#: three suffice.
MAX_STEP = 12
#: Eigenvalue, relative to the lowest elastic one, below which a mode is a rigid-body motion.
RIGID = 1e-6
#: Smallest length of the part of a unit column outside the known shapes for which it is a new direction.
NEW_DIRECTION = 1e-10
#: Eigenvalue of a Gram matrix of unit columns below which it is zero.
DEPENDENT = 1e-12


@on_one_blas_thread
def rom_error(system: LinearSystem, rom: ReducedModel, n_mode: int) -> Float[Real, " m"]:
    r"""Estimated relative error (f_rom - f_full) / f_full of each of the lowest frequencies.

    A Craig-Bampton model lacks the higher fixed-interface modes, which the boundary excites only through the inertia
    that it transmits to the interior, P = (M T_b)_i. The shapes from static solves with this inertia,

    .. math:: W_0 = K_{ii}^{-1} P \phi_b, \qquad W_{s+1} = K_{ii}^{-1} M_{ii} W_s

    (phi_b: boundary part of the reduced modes; with a few additional random columns; all M-orthogonal to the retained
    modes) span a small space that contains nearly all of the missing part. The reduced model with these additional
    interior shapes has frequencies between those of the full and of the reduced model; the estimate is the decrease to
    them, and steps are added until it converges. It is too low by a few per cent.

    The cost is one factorisation of K_ii and n_mode + 4 solves per step, usually with two or three steps.

    Parameters
    ----------
    system
        Full model from which the reduced model was made.
    rom
        Reduced model.
    n_mode
        Number of frequencies [-]; at most as many as the model has.

    Returns
    -------
    Estimated errors, shape (n_mode,) [-], not negative; errors below about 1e-11 are lost in round-off.

    Raises
    ------
    RomError
        The model was not made from this system, or has fewer frequencies.
    """
    interior = _find_interior(system, rom)
    modes = rom.modes(n_mode)
    lambda_ = modes.angular_frequency**2
    error = np.zeros(n_mode)
    if not len(interior):
        return error
    mass, stiffness = part(system.mass, interior), part(system.stiffness, interior)
    factor = factorise(stiffness)
    retained = rom.recovery[interior, rom.n_boundary :]

    moved = rom.recovery[:, : rom.n_boundary] @ modes.mode_shapes[: rom.n_boundary]
    inertia = (system.mass @ moved)[interior]
    random = mass @ np.random.default_rng(0).standard_normal((len(interior), N_RANDOM))
    added = np.zeros((len(interior), 0))
    block = factor.solve(np.hstack([inertia, random]))
    for step in range(MAX_STEP):
        block = _find_new_directions(block, np.hstack([retained, added]), mass)
        if not block.shape[1]:
            break  # the added shapes span all motions that the inertia excites, so no part is missing
        added = np.hstack([added, block])
        before, error = error, _drop(system, rom, interior, added, stiffness @ added, lambda_)
        if step and np.all(np.abs(error - before) <= CONVERGED * error + NEGLIGIBLE):
            break
        block = factor.solve(mass @ block)
    return error


def check_fixed_interface_modes(system: LinearSystem, rom: ReducedModel) -> ModeCheck:
    """Compute residuals of the fixed-interface modes of a reduced model, and count the modes that it should have.

    The two factorisations, for the residuals and for the count, cost more than half of the reduction.

    Parameters
    ----------
    system
        System that was reduced.
    rom
        Reduced model with at least one mode.

    Raises
    ------
    RomError
        The model was not made from this system or has no modes, or the count is uncertain for all shifts.
    """
    inner = _find_interior(system, rom)
    if rom.n_boundary == rom.n_dof:
        raise RomError("the reduced model keeps no fixed-interface modes: there is nothing to check")
    try:
        return check_modes(
            part(system.stiffness, inner).tocsr(),
            part(system.mass, inner).tocsr(),
            (2 * np.pi * rom.fixed_interface_frequency) ** 2,
            rom.recovery[inner, rom.n_boundary :],
        )
    except UnknownInertia as error:
        raise RomError(f"the fixed-interface modes cannot be counted ({error}): reduce without a check") from error


def _find_interior(system: LinearSystem, rom: ReducedModel) -> Whole:
    """Rows of the system that are not retained, shape (i,)."""
    if system.n_node != rom.n_node or not np.array_equal(system.free, rom.free):
        raise RomError(
            f"the reduced model of {len(rom.free)} degrees of freedom was not made from this system of {system.n_dof}: "
            "give the system that was reduced"
        )
    boundary = np.searchsorted(rom.free, 3 * rom.boundary_node + rom.boundary_direction)
    return np.setdiff1d(np.arange(system.n_dof), boundary)


def _drop(
    system: LinearSystem, rom: ReducedModel, interior: Whole, added: Matrix, stiffness_added: Matrix, lambda_: Vector
) -> Vector:
    """Relative decrease of each frequency when the interior shapes are added to the reduced model.

    Interior shapes are K-orthogonal to constraint modes, and to retained modes if they are M-orthogonal to them: the
    enriched stiffness is block diagonal, and the mass couples them to the boundary only, as in any Craig-Bampton model.
    """
    n_boundary, n_rom = rom.n_boundary, rom.n_dof
    whole = np.zeros((system.n_dof, added.shape[1]))
    whole[interior] = added
    carried = system.mass @ whole
    mass = scipy.linalg.block_diag(rom.mass, added.T @ carried[interior])
    mass[:n_boundary, n_rom:] = rom.recovery[:, :n_boundary].T @ carried
    mass[n_rom:, :n_boundary] = mass[:n_boundary, n_rom:].T
    stiffness = scipy.linalg.block_diag(rom.stiffness, added.T @ stiffness_added)
    enriched = compute_dense_modes(mass, stiffness)
    lowered = enriched.lambda_[: len(lambda_)]
    # Rigid-body motions are exact: their eigenvalues are round-off, and their ratio is meaningless.
    ratio = np.divide(lambda_, lowered, out=np.ones_like(lambda_), where=lowered > RIGID * enriched.shift)
    return np.asarray(np.sqrt(ratio.clip(min=1)) - 1)


def _find_new_directions(block: Matrix, known: Matrix, mass: Symmetric) -> Matrix:
    """M-orthonormal basis of the part of a block that is M-orthogonal to the M-orthonormal known shapes."""
    block = _normalise_columns(block, mass, 0.0)  # any length is accepted, because small bodies have short shapes
    for _ in range(2):  # the second pass removes the round-off of the first
        block = _normalise_columns(block - known @ (known.T @ (mass @ block)), mass, NEW_DIRECTION)
        gram = block.T @ (mass @ block)
        size, direction = np.linalg.eigh((gram + gram.T) / 2)
        remaining = size > DEPENDENT
        block = block @ (direction[:, remaining] / np.sqrt(size[remaining]))
    return block


def _normalise_columns(block: Matrix, mass: Symmetric, least: float) -> Matrix:
    """Columns of unit length in the mass norm, without columns whose length is at most `least`."""
    length = np.sqrt(np.einsum("ik,ik->k", block, mass @ block))
    remaining = length > least
    return np.asarray(block[:, remaining] / length[remaining])
