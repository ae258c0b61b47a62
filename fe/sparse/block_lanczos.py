"""Block Lanczos on K^-1 M: the lowest modes of a large sparse system, several right-hand sides at a time.

A solve reads the whole factor from memory for any number of right-hand sides; per column, twelve at once cost less than
four.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from fe.allocator import return_freed_memory
from fe.sparse.factor import Factor, Symmetric
from fe.sparse.krylov_basis import KrylovBasis
from fe.sparse.krylov_basis import NoConvergence as NoConvergence
from fe.sparse.node_matrix import BlockProduct

Matrix = NDArray[np.float64]

#: Columns of a block for few and for many modes, and smallest number of many modes: a wide block costs less per column,
#: but more columns are needed.
NARROW, WIDE, MANY = 4, 12, 20
#: Final ||K^-1 M x - theta x||_M / theta: eigenvalues are then accurate to round-off, and vectors to 1e-9 in the energy
#: norm, which is larger.
TOLERANCE = 5e-11
#: Relative residual at which theta is accurate to about 1e-10, and relative change of theta that shows a newly found
#: mode.
SETTLED, JUMP = 1e-5, 1e-8
#: Number of blocks after fresh random columns, in which a mode can appear that all previous columns missed.
TRIAL = 3
#: Blocks of the basis in addition to two columns per mode: a blade then restarts at most once, which takes up to three
#: per cent of the time (a cube, with pairs of modes, eight), and the basis needs a tenth less memory than without
#: restarts. If this exceeds the memory [byte], the basis has two columns per mode or the required minimum, which costs
#: up to a tenth more solves.
SPACIOUS, MEMORY = 13, 5e8
#: Blocks beyond the modes that a restart keeps, and new blocks for which the basis always has room.
SPARE, NEW = 4, 3
#: Largest number of restarts.
MAX_RESTART = 100
#: Approximate number of right-hand sides per mode, for many modes.
COLUMNS_PER_MODE = 3


def block_lanczos(
    factor: Factor,
    mass: Symmetric | BlockProduct,
    n_mode: int,
    *,
    block: int | None = None,
    max_basis: int | None = None,
    seed: int = 0,
) -> tuple[Float[Matrix, " m"], Float[Matrix, "n m"]]:
    r"""Eigenpairs of K x = lambda M x with the smallest magnitude of lambda.

    .. math:: K^{-1} M Q = Q H + W R, \qquad [Q\ W]^T M [Q\ W] = I, \qquad H s = \theta s, \quad x = Q s, \quad
              \lambda = 1 / \theta, \quad \|K^{-1} M x - \theta x\|_M = \|R s\|

    A Krylov space contains at most as many copies of a repeated mode as its first block has columns, and residuals do
    not reveal missing copies. Fresh random columns are therefore added to W before the end, repeatedly until the list
    of modes no longer changes.

    Parameters
    ----------
    factor
        Factor of the stiffness K, shape (n, n).
    mass
        Mass matrix M, symmetric positive definite, shape (n, n).
    n_mode
        Number of pairs, 1 to n [-].
    block
        Number of columns of a block; by default as in `choose_block` [-].
    max_basis
        Number of columns of Q at which a restart compresses them; by default, and at least, as in `basis_columns` [-].
    seed
        Seed of the random columns: runs with the same seed give identical results.

    Returns
    -------
    Eigenvalues, ascending, shape (m,), and mass-normalised eigenvectors (n, m).

    Raises
    ------
    NoConvergence
        The limit of restarts was reached, or no directions are left.

    References
    ----------
    Grimes, Lewis and Simon, SIAM J. Matrix Anal. Appl. 15 (1994) 228-272, sections 2 to 4: block Lanczos.
    Wu and Simon, SIAM J. Matrix Anal. Appl. 22 (2000) 602-616: thick restart.
    """
    block = block or choose_block(n_mode)
    kept, n_fresh = n_mode + SPARE * block, count_first_random_columns(block)
    basis = _make_basis(factor, mass, block, basis_columns(mass.shape[0], n_mode, block, max_basis), seed)
    settled, trial_end, next_test, n_restart = np.zeros(n_mode), 0, kept, 0
    while True:
        basis.reserve(kept + NEW * basis.width)
        if n_restart == MAX_RESTART or not basis.width:
            raise NoConvergence(f"{n_mode} modes did not converge: {basis.n_solved} solutions give no further progress")
        if basis.is_full:
            basis.compress(min(kept, basis.size))
            n_restart += 1
        basis.expand()
        if basis.width and not basis.is_full and basis.n_solved < next_test:
            continue
        if basis.size < n_mode:  # an invariant space with fewer columns than modes
            basis.refresh(block)
            continue
        theta, coordinates, residual = basis.ritz_pairs(n_mode)
        error = residual / np.abs(theta)
        is_tried = basis.n_solved >= trial_end or not basis.width
        if is_tried and error.max() <= SETTLED and np.any(np.abs(theta - settled) > JUMP * np.abs(theta)):
            settled = theta
            basis.refresh(n_fresh)
            n_fresh *= 2
            trial_end = next_test = basis.n_solved + TRIAL * basis.width
        elif is_tried and error.max() <= TOLERANCE:
            break
        else:
            next_test = basis.n_solved + _until_next_test(error > (TOLERANCE if trial_end else SETTLED), basis.width)
        if basis.size == mass.shape[0]:
            break
    order = np.argsort(1 / theta)
    return 1 / theta[order], basis.take_vectors(coordinates[:, order])


def _make_basis(factor: Factor, mass: Symmetric | BlockProduct, block: int, max_basis: int, seed: int) -> KrylovBasis:
    product = mass if isinstance(mass, BlockProduct) else BlockProduct(mass)
    basis = KrylovBasis(factor, product, max_basis, seed)
    return_freed_memory()  # temporary copies from the construction of the product
    basis.refresh(block)
    return basis


def _until_next_test(is_open: NDArray[np.bool_], width: int) -> int:
    """Number of solutions until the next test of convergence: about one mode converges per column."""
    return min(max(int(np.count_nonzero(is_open)), width), 6 * width)


def choose_block(n_mode: int) -> int:
    """Number of columns of a block [-]."""
    return WIDE if n_mode >= MANY else NARROW


def count_first_random_columns(block: int) -> int:
    """Number of random columns that are added first [-]."""
    return max(2, block // 4)


def basis_columns(n: int, n_mode: int, block: int, most: int | None = None) -> int:
    """Number of columns of Q at which a restart compresses them [-]; `most` is the user's limit."""
    least = n_mode + SPARE * block + NEW * (block + count_first_random_columns(block))
    free = max(2 * n_mode, min(2 * n_mode + SPACIOUS * block, int(MEMORY / (8 * n))))
    return max(most or free, least)
