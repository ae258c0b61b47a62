"""Krylov space of block Lanczos: an orthonormal basis, the operator projected onto it, and the next block."""

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.linalg.blas import dgemm

from fe.sparse.factor import LONG, Factor
from fe.sparse.node_matrix import BlockProduct

Matrix = NDArray[np.float64]

#: Size of a direction, relative to its block, below which it is round-off, and below which it is made orthogonal again.
NOISE, UNCLEAN = 1e-12, 1e-6
#: Growth of round-off at which a product with the mass is computed again.
STALE = 1e4
#: Number of rows of the basis that are combined at once.
PIECE = 4096
#: Largest number of sweeps to make a block orthonormal; blades need three.
MAX_SWEEP = 12


class NoConvergence(ArithmeticError):
    """Error if the restarts or the directions ran out: the factor does not solve to working accuracy."""


class KrylovBasis:
    """Basis Q of `size` columns, H, R, and the next block W of `width` columns, 0 if Q spans an invariant space."""

    def __init__(self, factor: Factor, mass: BlockProduct, capacity: int, seed: int) -> None:
        n = mass.shape[0]
        self._factor, self._mass = factor, mass
        self._random = np.random.default_rng(seed)
        self._vectors = np.empty((n, min(n, capacity)), order="F")
        self._next = self._mass_next = np.empty((n, 0), order="F")
        self._free: list[Matrix] = []  # blocks for reuse in the next step, because allocating memory takes time
        self._projected = np.empty((0, 0))
        self._coupling = np.empty((0, 0))  # R, for the columns of Q from `previous` on; it is zero for the others
        self._previous = 0
        self.n_solved = 0

    @property
    def size(self) -> int:
        """Number of columns of Q."""
        return len(self._projected)

    @property
    def width(self) -> int:
        """Number of columns of W."""
        return self._next.shape[1]

    @property
    def is_full(self) -> bool:
        """Whether Q has no room for W."""
        return self.size + self.width > self._vectors.shape[1]

    def reserve(self, capacity: int) -> None:
        """Enlarge the memory of Q to `capacity` columns, including W."""
        n, old = len(self._vectors), self._vectors
        if min(capacity, n) > old.shape[1]:
            self._vectors = np.empty((n, min(capacity, n)), order="F")
            self._vectors[:, : self.size] = old[:, : self.size]

    def expand(self) -> None:
        """Move W into Q, apply K^-1 M to it, and make the part orthogonal to Q the next W."""
        W, MW, before, start = self._next, self._mass_next, slice(self._previous, self.size), self.size
        self._vectors[:, start : start + self.width] = W
        H = np.zeros((start + self.width, start + self.width))
        H[:start, :start] = self._projected
        self._projected, self._previous = H, start
        self.n_solved += self.width
        column = self._solve(MW, self._place(MW.shape))
        # First orthogonal to the last two blocks, as in the recurrence, then to all blocks because of round-off.
        own = _projected(MW, column)
        column = dgemm(-1.0, W, own, 1.0, column, overwrite_c=1)
        column = dgemm(-1.0, self._vectors[:, before], self._coupling, 1.0, column, trans_b=1, overwrite_c=1)
        column, part = self._orthogonalise_to_basis(column)
        part[before] += self._coupling.T
        part[start:] += own
        part[start:] = (part[start:] + part[start:].T) / 2
        H[:, start:], H[start:, :] = part, part.T
        self._free += [W, MW]
        self._coupling = self._orthonormalise(column, float(np.linalg.norm(part, 2)))

    def refresh(self, n_column: int) -> None:
        """Add random columns to W, smoothed by one solve."""
        n, width = len(self._vectors), self.width
        n_column = min(n_column, n - self.size - width)
        if n_column <= 0:
            return
        fresh = self._solve(self._mass @ self._random.standard_normal((n, n_column)))
        fresh /= np.sqrt(np.einsum("nk,nk->k", fresh, self._mass @ fresh))
        for _ in range(2):
            fresh, _part = self._orthogonalise_to_basis(fresh)
        widened = np.asfortranarray(np.hstack([self._next, fresh]))
        # Free the memory of the parts.
        self._next = self._mass_next = fresh = widened[:, :0]
        self._free = []
        self._coupling = self._orthonormalise(widened, 1.0)[:, :width] @ self._coupling

    def ritz_pairs(self, n_pair: int) -> tuple[Matrix, Matrix, Matrix]:
        """Ritz values theta with the largest magnitudes, coordinates of their vectors in Q, and their residuals."""
        theta, S = scipy.linalg.eigh(self._projected)
        order = np.argsort(-np.abs(theta), kind="stable")[:n_pair]
        residual = np.linalg.norm(self._coupling @ S[self._previous :, order], axis=0)
        return theta[order], S[:, order], residual

    def take_vectors(self, coordinates: Matrix) -> Matrix:
        """Vectors in the span of Q, in its memory; the basis cannot be used afterwards."""
        self._combine(coordinates)
        self._free = []
        # Shrinks in place, because columns are contiguous; the rest of the memory is freed.
        vectors, self._vectors = self._vectors, np.empty((0, 0))
        vectors.resize((len(vectors), coordinates.shape[1]), refcheck=False)
        return vectors

    def _combine(self, coordinates: Matrix) -> None:
        """Replace Q by vectors in its span, in place, because there may be no memory for two bases."""
        for first in range(0, len(self._vectors), PIECE):
            piece = slice(first, first + PIECE)
            # Transposed, so that the result is copied in the order of memory.
            self._vectors[piece, : coordinates.shape[1]] = (coordinates.T @ self._vectors[piece, : self.size].T).T

    def compress(self, n_kept: int) -> None:
        """Thick restart: the best Ritz vectors replace Q, and W is kept."""
        theta, S, _residual = self.ritz_pairs(n_kept)
        self._combine(S)
        self._coupling = self._coupling @ S[self._previous :]
        self._projected, self._previous = np.diag(theta), 0

    def _place(self, shape: tuple[int, ...]) -> Matrix:
        """Block for reuse, or a new one; free blocks of another shape are discarded."""
        while self._free:
            block = self._free.pop()
            if block.shape == shape:
                return block
        return np.empty(shape, order="F")

    def _solve(self, right_hand_side: Matrix, place: Matrix | None = None) -> Matrix:
        solution = np.asfortranarray(self._factor.solve(right_hand_side, place))
        if not np.isfinite(solution).all():
            raise NoConvergence("the factor's solution is not finite: its matrix is singular")
        return solution

    def _orthogonalise_to_basis(self, column: Matrix) -> tuple[Matrix, Matrix]:
        """Make columns orthogonal to Q in place, and return them with the coordinates of their part along Q."""
        if not column.size:  # BLAS refuses empty arrays
            return column, np.empty((self.size, 0))
        Q = self._vectors[:, : self.size]
        part = _projected(Q, self._mass.multiply_in_workspace(column))
        return _subtract_product(column, Q, part), part

    def _orthonormalise(self, column: Matrix, scale: float) -> Matrix:
        """Make W from the columns and return R, with column = W R except for round-off relative to `scale`."""
        # Each sweep divides by the root of the Gram matrix, with eigenvalues of at least round-off, until the matrix is
        # nearly one.
        R, product = np.eye(column.shape[1]), column
        worst, stale, is_clean = 0.0, np.inf, False
        for _sweep in range(MAX_SWEEP):
            if not column.shape[1] or (worst > 0.1 and is_clean):
                break
            if stale > STALE:
                product, stale = self._mass.multiply_into(self._place(column.shape), column), 1.0
            gram = _projected(column, product)
            length = np.sqrt(np.diag(gram).clip(min=np.finfo(float).tiny))
            value, U = scipy.linalg.eigh((gram + gram.T) / 2 / np.outer(length, length))
            root = np.sqrt(value.clip(min=np.finfo(float).eps))
            division = np.asfortranarray(U / length[:, None] / root)
            used = [column, product]
            column, product = (dgemm(1.0, a, division, 0.0, self._place(a.shape), overwrite_c=1) for a in used)
            self._free += used
            R = (root[:, None] * U.T * length) @ R
            worst = float(value[0])
            stale /= max(worst, np.finfo(float).eps)
            left, size, right = np.linalg.svd(R)
            n_left = min(int(np.count_nonzero(size > NOISE * scale)), len(column) - self.size)
            is_clean |= n_left == len(size) and size[-1] > UNCLEAN * scale
            if not is_clean or worst < UNCLEAN:  # small remaining directions have a part along Q again
                column = dgemm(1.0, column, np.asfortranarray(left[:, :n_left])) if n_left else column[:, :0]
                column, _part = self._orthogonalise_to_basis(column)
                R, worst, stale, is_clean = size[:n_left, None] * right[:n_left], 0.0, np.inf, True
        else:
            raise NoConvergence("the solutions of the factor cannot be orthogonalised: its matrix is singular")
        self._next, self._mass_next = column, product[:, : column.shape[1]]
        return R


def _projected(basis: Matrix, columns: Matrix) -> Matrix:
    """The product basis^T columns."""
    if len(basis) < LONG:
        return np.asarray(dgemm(1.0, basis, columns, trans_a=1))
    # Imported only for long columns, because importing the compiler takes time.
    from fe.sparse.narrow_product import project

    return project(basis, columns)


def _subtract_product(columns: Matrix, basis: Matrix, factors: Matrix) -> Matrix:
    """The difference columns - basis factors, in place of the columns."""
    if len(basis) < LONG:
        return np.asarray(dgemm(-1.0, basis, factors, 1.0, columns, overwrite_c=1))
    from fe.sparse.narrow_product import subtract

    subtract(columns, basis, factors)
    return columns
