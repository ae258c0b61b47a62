"""The space that block Lanczos spans: an orthonormal basis, the operator projected onto it, and the next block."""

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.linalg.blas import dgemm

from fe.sparse.factor import LONG, Factor
from fe.sparse.node_matrix import BlockProduct

Matrix = NDArray[np.float64]

#: Against the block it is left of, a direction that is round-off, and one to be made orthogonal once more.
NOISE, UNCLEAN = 1e-12, 1e-6
#: Growth of round-off at which a product with the mass is computed anew.
STALE = 1e4
#: Rows of the basis that are combined at once.
PIECE = 4096
#: Before giving up: blades need three sweeps to make a block orthonormal.
MAX_SWEEP = 12


class NoConvergence(ArithmeticError):
    """The restarts or the directions ran out: the factor does not solve to working accuracy."""


class KrylovBasis:
    """Q of `size` columns, H, R, and the next block W of `width` columns, none if Q spans an invariant space."""

    def __init__(self, factor: Factor, mass: BlockProduct, capacity: int, seed: int) -> None:
        n = mass.shape[0]
        self._factor, self._mass = factor, mass
        self._random = np.random.default_rng(seed)
        self._vectors = np.empty((n, min(n, capacity)), order="F")
        self._next = self._mass_next = np.empty((n, 0), order="F")
        self._free: list[Matrix] = []  # blocks that the next step may write over: fresh memory costs time
        self._projected = np.empty((0, 0))
        self._coupling = np.empty((0, 0))  # R, for the columns of Q from `previous` on; it is zero for the others
        self._previous = 0
        self.n_solved = 0

    @property
    def size(self) -> int:
        """Columns of Q."""
        return len(self._projected)

    @property
    def width(self) -> int:
        """Columns of W."""
        return self._next.shape[1]

    @property
    def is_full(self) -> bool:
        """Whether Q cannot take W."""
        return self.size + self.width > self._vectors.shape[1]

    def reserve(self, capacity: int) -> None:
        """Let Q grow to so many columns, W included."""
        n, old = len(self._vectors), self._vectors
        if min(capacity, n) > old.shape[1]:
            self._vectors = np.empty((n, min(capacity, n)), order="F")
            self._vectors[:, : self.size] = old[:, : self.size]

    def expand(self) -> None:
        """Move W into Q, apply K^-1 M to it, and leave what is orthogonal to Q as the next W."""
        W, MW, before, start = self._next, self._mass_next, slice(self._previous, self.size), self.size
        self._vectors[:, start : start + self.width] = W
        H = np.zeros((start + self.width, start + self.width))
        H[:start, :start] = self._projected
        self._projected, self._previous = H, start
        self.n_solved += self.width
        column = self._solve(MW, self._place(MW.shape))
        # First along the last two blocks, as the recurrence says; then along all, where round-off has left a little.
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
        """Widen W by random columns, smoothed by one solve."""
        n, width = len(self._vectors), self.width
        n_column = min(n_column, n - self.size - width)
        if n_column <= 0:
            return
        fresh = self._solve(self._mass @ self._random.standard_normal((n, n_column)))
        fresh /= np.sqrt(np.einsum("nk,nk->k", fresh, self._mass @ fresh))
        for _ in range(2):
            fresh, _part = self._orthogonalise_to_basis(fresh)
        widened = np.asfortranarray(np.hstack([self._next, fresh]))
        # Not to stand beside what they have gone into.
        self._next = self._mass_next = fresh = widened[:, :0]
        self._free = []
        self._coupling = self._orthonormalise(widened, 1.0)[:, :width] @ self._coupling

    def ritz_pairs(self, n_pair: int) -> tuple[Matrix, Matrix, Matrix]:
        """Theta of the largest magnitudes, their coordinates in Q, and their residuals."""
        theta, S = scipy.linalg.eigh(self._projected)
        order = np.argsort(-np.abs(theta), kind="stable")[:n_pair]
        residual = np.linalg.norm(self._coupling @ S[self._previous :, order], axis=0)
        return theta[order], S[:, order], residual

    def take_vectors(self, coordinates: Matrix) -> Matrix:
        """Vectors in the span of Q, in its memory; the basis cannot be used afterwards."""
        self._combine(coordinates)
        self._free = []
        # Shrinks in place, columns first; the rest goes back to the system.
        vectors, self._vectors = self._vectors, np.empty((0, 0))
        vectors.resize((len(vectors), coordinates.shape[1]), refcheck=False)
        return vectors

    def _combine(self, coordinates: Matrix) -> None:
        """Put vectors in the span of Q in its place; two bases may not fit where one does."""
        for first in range(0, len(self._vectors), PIECE):
            piece = slice(first, first + PIECE)
            # In the order of memory, so that what is found is copied into its columns as it stands.
            self._vectors[piece, : coordinates.shape[1]] = (coordinates.T @ self._vectors[piece, : self.size].T).T

    def compress(self, n_kept: int) -> None:
        """Thick restart: the best Ritz vectors take the place of Q, and W stays."""
        theta, S, _residual = self.ritz_pairs(n_kept)
        self._combine(S)
        self._coupling = self._coupling @ S[self._previous :]
        self._projected, self._previous = np.diag(theta), 0

    def _place(self, shape: tuple[int, ...]) -> Matrix:
        """A block that may be written over; those of another shape are no longer wanted."""
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
        if not column.size:  # BLAS refuses to do nothing
            return column, np.empty((self.size, 0))
        Q = self._vectors[:, : self.size]
        part = _projected(Q, self._mass.multiply_in_workspace(column))
        return _subtract_product(column, Q, part), part

    def _orthonormalise(self, column: Matrix, scale: float) -> Matrix:
        """Make W of the columns; R with column = W R, but for directions that are round-off against `scale`."""
        # Each sweep divides by the root of the Gram matrix, its eigenvalues lifted to round-off, until it is near one.
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
            if not is_clean or worst < UNCLEAN:  # what little is left has a part along Q again
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
    # The compiler takes a while to import: short columns do without.
    from fe.sparse.narrow_product import project

    return project(basis, columns)


def _subtract_product(columns: Matrix, basis: Matrix, factors: Matrix) -> Matrix:
    """The difference columns - basis factors, in place of the columns."""
    if len(basis) < LONG:
        return np.asarray(dgemm(-1.0, basis, factors, 1.0, columns, overwrite_c=1))
    from fe.sparse.narrow_product import subtract

    subtract(columns, basis, factors)
    return columns
