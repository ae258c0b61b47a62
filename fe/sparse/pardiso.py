"""Factorise with MKL PARDISO, called directly.

The public `solve` of the `pypardiso` wheel needs both triangles (twice the memory, twice the factor time) and hashes
the matrix on every call; here the upper triangle is analysed once and factorised for each set of values.

References
----------
Intel oneMKL reference, PARDISO: phases, mtype and the parameters iparm, which count from 1 there and from 0 here.
"""

import ctypes
import weakref
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fe.allocator import return_freed_memory
from fe.sparse.factor import (
    Columns,
    Definiteness,
    Symmetric,
    UnknownInertia,
    check_diagonal,
    check_pattern,
    columns_and_place,
    make_changed_pattern_error,
    singular,
)
from fe.sparse.mkl import library
from fe.sparse.symmetry import check_symmetric
from fe.sparse.upper_blocks import UpperBlocks
from fe.sparse.upper_triangle import MIN_BLOCKED, Upper, blocks_or_csr, take_upper_triangle

ANALYSE, FACTORISE, SOLVE, RELEASE = 11, 22, 33, -1
ZERO_PIVOT = -4
#: Parameter with the equation of a pivot that is not positive.
NO_PIVOT = 29
#: Parameter that controls the order of rows.
ORDER = 4
#: Similarity of rows [%] above which PARDISO joins them to blocks, if rows do not come in threes; up to a fifth of the
#: entries may then be zeros. In both cases the graph of the nodes, a ninth as large, is ordered and analysed.
SIMILAR = 80
NO_VALUES = np.zeros(0)


class Pardiso:
    """Cholesky or Bunch-Kaufman LDL^T factorisation by PARDISO."""

    def __init__(self, matrix: Symmetric, definiteness: Definiteness) -> None:
        self._positive = definiteness is Definiteness.POSITIVE
        matrix = blocks_or_csr(matrix)
        self._n, self._shape, self._nnz = matrix.shape[0], matrix.shape, matrix.nnz
        self._upper = self._checked(matrix)
        self._call = _Handle(self._upper, 2 if self._positive else -2)
        # Python does not manage MKL's memory; without this call it would never be freed. At the end of the process it
        # is not needed, and MKL may be unloaded already.
        weakref.finalize(self, self._call, RELEASE, self._upper._replace(values=NO_VALUES)).atexit = False
        self._call(ANALYSE, self._upper)
        self._factorise()

    def renew(self, matrix: Symmetric) -> None:
        """As `Factorisation.renew`."""
        check_symmetric(matrix)
        matrix = blocks_or_csr(matrix)
        check_pattern(matrix, self._shape, self._nnz)
        upper = self._checked(matrix)
        if not np.array_equal(upper.column, self._upper.column):
            raise make_changed_pattern_error()
        self._upper = self._upper._replace(values=upper.values)
        self._factorise()

    def _factorise(self) -> None:
        self._call(FACTORISE, self._upper)
        # If pivots were altered, PARDISO refines solutions with the matrix; Cholesky alters no pivots.
        if self._positive:
            self._upper = self._upper._replace(values=NO_VALUES)

    def solve(self, right_hand_side: Columns, out: Columns | None = None) -> Columns:
        """As `Factor.solve`."""
        columns, solution = columns_and_place(self._shape, right_hand_side, out)
        if not columns.size:
            return solution
        self._call(SOLVE, self._upper, columns, solution)
        return solution

    @property
    def n_negative(self) -> int:
        """As `Factorisation.n_negative`."""
        if self._call.parameters[13]:
            raise UnknownInertia(
                "PARDISO changed pivots that were too small, so their signs do not count eigenvalues: move the "
                "shift slightly"
            )
        return 0 if self._positive else int(self._call.parameters[22])

    @property
    def work(self) -> tuple[float, float] | None:
        """Entries of the factor and operations of the factorisation [-]; None if PARDISO chose the blocks."""
        entries, millions = (float(self._call.parameters[k]) for k in (17, 18))
        block = self._upper.block
        return None if self._call.parameters[36] < 0 else (entries * block**2, 1e6 * millions * block**3)

    def _checked(self, matrix: sp.csr_array | UpperBlocks) -> Upper:
        if self._positive:
            check_diagonal(matrix.diagonal())
        return take_upper_triangle(matrix)


def order_by_nested_dissection(upper: Upper) -> NDArray[np.int64]:
    """Order of rows that gives a factor with few entries, shape (n,).

    Raises
    ------
    ImportError, OSError
        MKL is missing or cannot be loaded.
    RuntimeError
        PARDISO failed, for example because of insufficient memory.
    """
    handle = _Handle(upper, 2)
    handle.parameters[ORDER] = 2  # returned
    order = np.zeros(len(upper.row_start) - 1, dtype=np.int32)
    try:
        handle(ANALYSE, upper, order=order)
    finally:
        handle(RELEASE, upper)
        library().MKL_Free_Buffers()
        return_freed_memory()
    return (upper.block * order.astype(np.int64)[:, None] + np.arange(upper.block)).ravel()


class _Handle:
    """Parameters and memory of PARDISO."""

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
        self.parameters[36] = upper.block if upper.block > 1 else (-SIMILAR if n > MIN_BLOCKED else 0)

    def __call__(
        self,
        phase: int,
        upper: Upper,
        b: NDArray[np.float64] | None = None,
        x: NDArray[np.float64] | None = None,
        order: NDArray[np.int32] | None = None,
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
            pointer(no_order if order is None else order, ctypes.c_int32),
            integer(1 if b is None or b.ndim == 1 else b.shape[1]),
            pointer(self.parameters, ctypes.c_int32),
            integer(0),
            pointer(nothing if b is None else b, ctypes.c_double),
            pointer(nothing if x is None else x, ctypes.c_double),
            ctypes.byref(error),
        )
        # With blocks of nodes, the error code of a pivot that is not positive is the number of its equation.
        if error.value == ZERO_PIVOT or (error.value < 0 and self.parameters[NO_PIVOT] == error.value):
            raise singular(self._n * upper.block)
        if error.value:
            raise RuntimeError(f"PARDISO failed in phase {phase} with error {error.value}")
