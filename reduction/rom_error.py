"""How well a reduced model knows the full one, without solving that: frequencies, and fixed-interface modes."""

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

#: Random start vectors, which find truncated modes that the boundary's motion does not excite.
N_RANDOM = 4
#: A step that changes no estimate by more than this share is the last; the estimate promises a factor, not digits.
CONVERGED = 0.1
#: Estimates below this relative error are round-off of the sparse solve.
NEGLIGIBLE = 1e-12
#: Blocks of added shapes at most: each is a factor (lambda / omega_{m+1}^2)^2 nearer, so two or three do.
MAX_STEP = 12
#: An eigenvalue below this share of the lowest elastic one belongs to a rigid-body motion.
RIGID = 1e-6
#: Length that a unit column keeps, outside the known shapes, for it to count as a new direction.
NEW_DIRECTION = 1e-10
#: Eigenvalue of a Gram matrix of unit columns that counts as zero.
DEPENDENT = 1e-12


@on_one_blas_thread
def rom_error(system: LinearSystem, rom: ReducedModel, n_mode: int) -> Float[Real, " m"]:
    r"""Estimated relative error (f_rom - f_full) / f_full of each of the lowest frequencies.

    What a Craig-Bampton model leaves out are fixed-interface modes, and the boundary reaches those only through the
    inertia it gives to the interior, P = (M T_b)_i. So the shapes that one static solve makes of this inertia,

    .. math:: W_0 = K_{ii}^{-1} P \phi_b, \qquad W_{s+1} = K_{ii}^{-1} M_{ii} W_s

    (phi_b: boundary part of the reduced modes; a few random columns added; all made M-orthogonal to the retained modes)
    span a small space that holds nearly all of what is missing. The reduced model with these as further interior
    shapes has frequencies between the full model's and the reduced one's; the estimate is the drop to them, and steps
    are added until it settles. So it errs to the low side, by a few per cent.

    The cost is one factorisation of K_ii and n_mode + 4 solves per step, two or three steps mostly.

    Parameters
    ----------
    system
        The full model from which the reduced one was made.
    rom
        The reduced model.
    n_mode
        How many frequencies [-]; at most as many as the model has.

    Returns
    -------
    Shape (n_mode,) [-], not negative; errors below about 1e-11 drown in round-off.

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
            break  # the added shapes span all that the inertia reaches: nothing is missing any more
        added = np.hstack([added, block])
        before, error = error, _drop(system, rom, interior, added, stiffness @ added, lambda_)
        if step and np.all(np.abs(error - before) <= CONVERGED * error + NEGLIGIBLE):
            break
        block = factor.solve(mass @ block)
    return error


def check_fixed_interface_modes(system: LinearSystem, rom: ReducedModel) -> ModeCheck:
    """Residuals of the fixed-interface modes of a reduced model, and a count of those it should have.

    It factorises twice, once for the residuals and once for the count: more than half of what the reduction took.

    Parameters
    ----------
    system
        The system that was reduced.
    rom
        The reduced model, with at least one mode.

    Raises
    ------
    RomError
        The model was not made from this system, has no modes, or the count proves nothing, whatever the shift.
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
    """Relative drop of each frequency when the added interior shapes join the reduced model.

    Interior shapes do no work against constraint modes, and none against retained modes they are M-orthogonal to: the
    enriched stiffness is block diagonal, and its mass couples to the boundary alone, as in any Craig-Bampton model.
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
    # A rigid-body motion is exact: its eigenvalues are round-off and have no ratio.
    ratio = np.divide(lambda_, lowered, out=np.ones_like(lambda_), where=lowered > RIGID * enriched.shift)
    return np.asarray(np.sqrt(ratio.clip(min=1)) - 1)


def _find_new_directions(block: Matrix, known: Matrix, mass: Symmetric) -> Matrix:
    """M-orthonormal basis of what the columns of a block add to the span of M-orthonormal known shapes."""
    block = _normalise_columns(block, mass, 0.0)  # of any length: small bodies have short shapes
    for _ in range(2):  # twice is enough: the first pass leaves round-off of the removed part, the second none
        block = _normalise_columns(block - known @ (known.T @ (mass @ block)), mass, NEW_DIRECTION)
        gram = block.T @ (mass @ block)
        size, direction = np.linalg.eigh((gram + gram.T) / 2)
        remaining = size > DEPENDENT
        block = block @ (direction[:, remaining] / np.sqrt(size[remaining]))
    return block


def _normalise_columns(block: Matrix, mass: Symmetric, least: float) -> Matrix:
    """Columns of unit length in the mass norm, without those that are no longer than `least`."""
    length = np.sqrt(np.einsum("ik,ik->k", block, mass @ block))
    remaining = length > least
    return np.asarray(block[:, remaining] / length[remaining])
