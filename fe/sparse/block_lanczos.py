"""Block Lanczos on K^-1 M: the lowest modes of a large sparse system, several right-hand sides at a time.

A solve reads the whole factor from memory whatever the number of right-hand sides: twelve at once cost less than four.
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

#: Columns solved for together, for few modes and for many: wider ones cost less each, but more are needed.
NARROW, WIDE, MANY = 4, 12, 20
#: ||K^-1 M x - theta x||_M / theta at the end: eigenvalues to round-off, and 1e-9 in the energy norm, which is larger.
TOLERANCE = 5e-11
#: At this residual a theta is good to about 1e-10, so that a mode found later shows as a jump in the list.
SETTLED, JUMP = 1e-5, 1e-8
#: Blocks that fresh random columns get to show a mode that all columns before were blind to.
TRIAL = 3
#: Blocks of the basis beside two columns per mode: a blade restarts once at most, for up to three per cent of the time
#: (a cube, with its pairs of modes, for eight), and the basis takes a tenth less memory than it would freely. Where
#: that were more memory than this [byte], there are two columns per mode, or the least that will do, for up to a tenth
#: more solves.
SPACIOUS, MEMORY = 13, 5e8
#: Blocks beyond the modes that a restart keeps, and new ones that the basis can take in any case.
SPARE, NEW = 4, 3
#: Before giving up.
MAX_RESTART = 100
#: Right-hand sides that a mode costs, of many modes, about.
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

    A Krylov space holds as many copies of a repeated mode as its first block has columns, and no residual tells of
    the others. So fresh random columns join W before the end, again and again until the list of modes stands still.

    Parameters
    ----------
    factor
        Factor of the stiffness K, shape (n, n).
    mass
        Symmetric positive definite, shape (n, n).
    n_mode
        Number of pairs, 1 to n [-].
    block
        Columns in a block, by default fewer for few modes.
    max_basis
        Columns of Q at which a restart compresses them, by default as `basis_columns` says; it always holds some blocks
        more than the modes.
    seed
        Seed of the random columns: two runs with one seed agree to the last bit.

    Returns
    -------
    Eigenvalues, ascending, shape (m,), and mass-normalised eigenvectors (n, m).

    Raises
    ------
    NoConvergence
        The restarts or the directions ran out.

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
        if basis.size < n_mode:  # an invariant space, found before it held all the modes asked for
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
    return_freed_memory()  # the copies that the product with the mass was made of
    basis.refresh(block)
    return basis


def _until_next_test(is_open: NDArray[np.bool_], width: int) -> int:
    """Solutions until the modes are looked at again: about one converges per column, so that few tests are enough."""
    return min(max(int(np.count_nonzero(is_open)), width), 6 * width)


def choose_block(n_mode: int) -> int:
    """Columns that are solved for together [-]."""
    return WIDE if n_mode >= MANY else NARROW


def count_first_random_columns(block: int) -> int:
    """Random columns that join first [-]."""
    return max(2, block // 4)


def basis_columns(n: int, n_mode: int, block: int, most: int | None = None) -> int:
    """Columns of Q at which a restart compresses them, for n degrees of freedom [-]; `most` is the user's limit."""
    least = n_mode + SPARE * block + NEW * (block + count_first_random_columns(block))
    free = max(2 * n_mode, min(2 * n_mode + SPACIOUS * block, int(MEMORY / (8 * n))))
    return max(most or free, least)
