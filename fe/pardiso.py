"""MKL PARDISO through the low-level handle of the `pypardiso` wheel.

The wheel's public `solve` takes both triangles (twice the memory, twice the factor time) and hashes the matrix on
every call; here the upper triangle is analysed once and factorised for each set of values.

References
----------
Intel oneMKL reference, PARDISO: phases, mtype and the parameters iparm, which count from 1 there and from 0 here.
"""

import ctypes
import weakref
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fe.factor import NODE, Columns, Definiteness, Symmetric, UnknownInertia, check_pattern, singular
from fe.mkl import library
from fe.upper_blocks import UpperBlocks

ANALYSE, FACTORISE, SOLVE, RELEASE = 11, 22, 33, -1
ZERO_PIVOT = -4
#: The parameter that tells the equation of a pivot that is not positive.
NO_PIVOT = 29
#: Zeros stored in blocks of a node may be this many times the entries; otherwise PARDISO looks for blocks itself, which
#: may fill up to a fifth. Either way the graph that is ordered and analysed is that of the nodes, a ninth as large.
FILL, SIMILAR = 1.05, 80
NO_VALUES = np.zeros(0)
#: Below this size no time is to be saved, and round-off is that of the plainest method.
SMALL = 3000


class Upper(NamedTuple):
    """Upper triangle of a symmetric matrix in square blocks: rows start, columns, values, and the length of a block."""

    row_start: NDArray[np.int32]
    column: NDArray[np.int32]
    values: NDArray[np.float64]
    block: int


class Pardiso:
    """Cholesky or Bunch-Kaufman LDL^T of the upper triangle."""

    def __init__(self, matrix: Symmetric, definiteness: Definiteness) -> None:
        self._positive = definiteness is Definiteness.POSITIVE
        matrix = _blocks_or_csr(matrix)
        self._n, self._shape, self._nnz = matrix.shape[0], matrix.shape, matrix.nnz
        self._upper = self._checked(matrix)
        self._call = _Handle(self._upper, 2 if self._positive else -2)
        # MKL's memory is outside Python's reach; without this call each factor would stay for ever. At the end of the
        # process there is nothing left to save, and MKL may be gone already.
        weakref.finalize(self, self._call, RELEASE, self._upper._replace(values=NO_VALUES)).atexit = False
        self._call(ANALYSE, self._upper)
        self._factorise()

    def renew(self, matrix: Symmetric) -> None:
        """As `Factorisation.renew`."""
        matrix = _blocks_or_csr(matrix)
        check_pattern(matrix, self._shape, self._nnz)
        upper = self._checked(matrix)
        if not np.array_equal(upper.column, self._upper.column):
            raise ValueError("the new matrix has entries in other places: factorise it by itself")
        self._upper = self._upper._replace(values=upper.values)
        self._factorise()

    def _factorise(self) -> None:
        self._call(FACTORISE, self._upper)
        # Where pivots were altered, a solution is refined with the matrix itself; Cholesky alters none.
        if self._positive:
            self._upper = self._upper._replace(values=NO_VALUES)

    def solve(self, right_hand_side: Columns) -> Columns:
        """As `Factor.solve`."""
        columns = np.asfortranarray(right_hand_side, dtype=np.float64)
        solution = np.empty_like(columns, order="F")
        self._call(SOLVE, self._upper, columns, solution)
        return solution

    @property
    def n_negative(self) -> int:
        """As `Factorisation.n_negative`."""
        if self._call.parameters[13]:
            raise UnknownInertia("PARDISO altered pivots that were too small: their signs do not count eigenvalues")
        return 0 if self._positive else int(self._call.parameters[22])

    @property
    def work(self) -> tuple[float, float] | None:
        """Entries of the factor's triangle, operations that made it [-]; None where PARDISO counts its own blocks."""
        entries, millions = (float(self._call.parameters[k]) for k in (17, 18))
        block = self._upper.block
        return None if self._call.parameters[36] < 0 else (entries * block**2, 1e6 * millions * block**3)

    def _checked(self, matrix: sp.csr_array | UpperBlocks) -> Upper:
        if self._positive and not (matrix.diagonal() > 0).all():
            raise singular(self._n)
        return upper_triangle(matrix)


def _blocks_or_csr(matrix: Symmetric) -> sp.csr_array | UpperBlocks:
    return matrix if isinstance(matrix, UpperBlocks) else matrix.tocsr()


def upper_triangle(matrix: sp.csr_array | UpperBlocks) -> Upper:
    """The upper triangle, in blocks of a node where rows and columns come by threes; with its whole diagonal."""
    n = matrix.shape[0]
    if isinstance(matrix, UpperBlocks):
        if n > SMALL:
            return Upper(matrix.row_start, matrix.column, matrix.values, NODE)
        matrix = matrix.tocsr()
    length = np.diff(matrix.indptr)
    if n > SMALL and n % NODE == 0 and (length.reshape(-1, NODE) == length[::NODE, None]).mean() > 1 / FILL:
        blocks = matrix.tobsr((NODE, NODE))
        if blocks.nnz <= FILL * matrix.nnz:
            upper = _above(blocks.indptr, blocks.indices, blocks.data, NODE)
            if _has_diagonal(upper):
                return upper
    upper = _above(matrix.indptr, matrix.indices, matrix.data, 1)
    if not _has_diagonal(upper):
        # PARDISO wants every diagonal entry stored, zeros too.
        row = np.repeat(np.arange(n), np.diff(upper.row_start))
        missing = np.setdiff1d(np.arange(n), row[upper.column == row])
        values = np.concatenate([upper.values, np.zeros(len(missing))])
        places = (np.concatenate([row, missing]), np.concatenate([upper.column, missing]))
        full = sp.csr_array(sp.coo_array((values, places), shape=matrix.shape))
        upper = _above(full.indptr, full.indices, full.data, 1)
    return upper


def _above(row_start: NDArray[Any], column: NDArray[Any], values: NDArray[np.float64], block: int) -> Upper:
    n = len(row_start) - 1
    row = np.repeat(np.arange(n, dtype=column.dtype), np.diff(row_start))
    kept = column >= row
    row, column, values = row[kept], column[kept], values[kept]
    if (np.diff(row.astype(np.int64) * n + column) <= 0).any():
        order = np.lexsort((column, row))
        column, values = column[order], values[order]
    start = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=n))])
    return Upper(start.astype(np.int32), column.astype(np.int32), np.ascontiguousarray(values, dtype=float), block)


def _has_diagonal(upper: Upper) -> bool:
    """Whether each row begins on the diagonal."""
    n = len(upper.row_start) - 1
    filled = np.diff(upper.row_start) > 0
    return bool(filled.all() and (upper.column[upper.row_start[:-1]] == np.arange(n)).all())


class _Handle:
    """Parameters and memory that PARDISO works on."""

    def __init__(self, upper: Upper, mtype: int) -> None:
        n = len(upper.row_start) - 1
        self._n, self._mtype = n, mtype
        self._run = library().pardiso
        self._memory = np.zeros(64, dtype=np.intp)  # addresses that PARDISO keeps between calls
        self.parameters = np.zeros(64, dtype=np.int32)
        self.parameters[0] = 1  # own parameters
        self.parameters[1] = 2  # nested dissection (METIS)
        self.parameters[9] = 8  # pivots perturbed below 1e-8, for the indefinite case
        self.parameters[17] = self.parameters[18] = -1  # count the factor's entries and operations
        self.parameters[20] = 1  # Bunch-Kaufman pivots, for the indefinite case
        self.parameters[34] = 1  # zero-based indices
        self.parameters[36] = upper.block if upper.block > 1 else (-SIMILAR if n > SMALL else 0)

    def __call__(
        self, phase: int, upper: Upper, b: NDArray[np.float64] | None = None, x: NDArray[np.float64] | None = None
    ) -> None:
        """Run one phase."""

        def integer(value: int) -> Any:
            return ctypes.byref(ctypes.c_int32(value))

        def pointer(values: NDArray[Any], kind: Any) -> Any:
            return values.ctypes.data_as(ctypes.POINTER(kind))

        nothing, no_order = np.zeros(1), np.zeros(0, dtype=np.int32)
        error = ctypes.c_int32(0)
        self._run(
            pointer(self._memory, ctypes.c_ssize_t),
            integer(1),
            integer(1),
            integer(self._mtype),
            integer(phase),
            integer(self._n),
            pointer(upper.values, ctypes.c_double),
            pointer(upper.row_start, ctypes.c_int32),
            pointer(upper.column, ctypes.c_int32),
            pointer(no_order, ctypes.c_int32),
            integer(1 if b is None or b.ndim == 1 else b.shape[1]),
            pointer(self.parameters, ctypes.c_int32),
            integer(0),
            pointer(nothing if b is None else b, ctypes.c_double),
            pointer(nothing if x is None else x, ctypes.c_double),
            ctypes.byref(error),
        )
        # With blocks of nodes the error of a pivot that is not positive is the number of its equation.
        if error.value == ZERO_PIVOT or (error.value < 0 and self.parameters[NO_PIVOT] == error.value):
            raise singular(self._n * upper.block)
        if error.value:
            raise RuntimeError(f"PARDISO failed in phase {phase} with error {error.value}")
