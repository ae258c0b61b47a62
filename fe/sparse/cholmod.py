"""Factorise with CHOLMOD of SuiteSparse, if the system has it: Cholesky in supernodes.

It is as fast as PARDISO and, unlike PARDISO, gives access to its factor, so that `fe.sparse.supernodes` can solve with
less memory traffic than either library.

References
----------
Chen, Davis, Hager and Rajamanickam, Algorithm 887: CHOLMOD, ACM Trans. Math. Softw. 35 (2008) 22.
"""

import ctypes
import weakref
import zlib
from ctypes import POINTER, byref, c_size_t, c_void_p
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fe.sparse.cholmod_library import (
    A_X_IS_B,
    COMMON,
    LOWER,
    NO_SHIFT,
    PATTERN,
    REAL,
    Dense,
    FactorHead,
    Sparse,
    configure,
    library,
    one_thread,
    view_doubles,
    view_integers,
)
from fe.sparse.factor import (
    Columns,
    Symmetric,
    TooLarge,
    check_diagonal,
    check_pattern,
    columns_and_place,
    make_changed_pattern_error,
    singular,
)
from fe.sparse.pardiso import order_by_nested_dissection
from fe.sparse.symmetry import check_symmetric
from fe.sparse.upper_triangle import LowerColumns, Upper, blocks_or_csr, take_upper_triangle

if TYPE_CHECKING:
    from fe.sparse.supernodes import Supernodes


class Cholmod:
    """Cholesky factor of a positive definite matrix."""

    def __init__(self, matrix: Symmetric) -> None:
        self._library = library()
        self._common = ctypes.create_string_buffer(COMMON)
        self._library.cholmod_start(self._common)
        self._factor = c_void_p(None)
        self._supernodes: Supernodes | None = None
        self._is_made = False
        weakref.finalize(self, _release, self._library, self._common, self._factor).atexit = False
        # Each stage frees what the next does not need: the matrix once its columns exist, and the columns before the
        # numbers of the factor are reordered.
        self._factorise(self._analysed(matrix))
        self._pack()

    def renew(self, matrix: Symmetric) -> None:
        """As `Factorisation.renew`."""
        columns = self._renewed(matrix)
        self._is_made = False
        if self._supernodes is not None:  # its tiles are in the memory to which CHOLMOD would write
            self._supernodes = None
            self._library.cholmod_change_factor(PATTERN, 1, 1, 1, 1, self._factor, self._common)
        self._factorise(columns)
        del columns
        self._pack()

    def solve(self, right_hand_side: Columns, out: Columns | None = None) -> Columns:
        """As `Factor.solve`."""
        if not self._is_made:
            raise singular(self._n, " in its last values: renew it with others")
        b, solution = columns_and_place(self._shape, right_hand_side, out)
        columns, places = (item.reshape(self._n, -1, order="F") for item in (b, solution))
        if self._supernodes is None:
            places[...] = self._library_solution(columns)
        else:
            self._supernodes.solve_into(places, columns)
        return solution

    @property
    def n_negative(self) -> int:
        """As `Factorisation.n_negative`."""
        return 0

    @property
    def work(self) -> tuple[float, float] | None:
        """Entries of the factor and operations of the factorisation [-]; None without supernodes."""
        return None if self._supernodes is None else self._supernodes.work

    @property
    def _head(self) -> Any:
        return ctypes.cast(self._factor, POINTER(FactorHead)).contents

    @property
    def _has_supernodes(self) -> bool:
        return bool(self._head.is_super and self._head.n_supernode)

    def _analysed(self, matrix: Symmetric) -> LowerColumns:
        """Analyse the matrix, and return its columns in the order of the factorisation."""
        matrix = blocks_or_csr(matrix)
        self._shape, self._nnz, self._n = matrix.shape, matrix.nnz, matrix.shape[0]
        # Without supernodes CHOLMOD would accept a pivot that is not a number, here and in `renew`.
        check_diagonal(matrix.diagonal())
        upper = take_upper_triangle(matrix)
        order = _order(upper)
        configure(self._common, is_ordered=order is not None)
        self._pattern = zlib.crc32(upper.column.data)
        pattern = _lower(upper, is_pattern=True)
        structure = _structure(pattern)
        self._factor.value = self._library.cholmod_analyze_p(
            byref(structure), None if order is None else order.ctypes.data, None, 0, self._common
        )
        if not self._factor.value:
            raise TooLarge(f"CHOLMOD cannot analyse a matrix of {self._n} rows: its factor has too many entries")
        del pattern
        return self._columns(upper)

    def _renewed(self, matrix: Symmetric) -> LowerColumns:
        """Columns of another matrix with the same pattern."""
        check_symmetric(matrix)
        matrix = blocks_or_csr(matrix)
        check_pattern(matrix, self._shape, self._nnz)
        check_diagonal(matrix.diagonal())
        upper = take_upper_triangle(matrix)
        if zlib.crc32(upper.column.data) != self._pattern:
            raise make_changed_pattern_error()
        return self._columns(upper)

    def _columns(self, upper: Upper) -> LowerColumns:
        """Columns for the factorisation, with supernodes in the order of the factor, which saves CHOLMOD a copy."""
        if not self._has_supernodes:
            return _lower(upper)
        from fe.sparse.lower_columns import ordered_columns

        return ordered_columns(upper, view_integers(self._head.order, self._n))

    def _factorise(self, columns: LowerColumns) -> None:
        structure = _structure(columns)
        with one_thread():
            if self._has_supernodes:
                arguments = byref(structure), None, NO_SHIFT, self._factor, self._common
                done = self._library.cholmod_super_numeric(*arguments)
            else:
                done = self._library.cholmod_factorize(byref(structure), self._factor, self._common)
        if not done:
            raise MemoryError(f"CHOLMOD has no memory for a factor of {self._n} rows")
        if self._head.minor < self._n:
            raise singular(self._n)
        self._is_made = True

    def _pack(self) -> None:
        """Put the numbers of the factor in the order of their use, in the same memory, and free the rest."""
        if not self._has_supernodes:
            return
        # Imported only for supernodes, because importing the compiler takes time.
        from fe.sparse.supernodes import Supernodes, pack

        head = self._head
        starts = [view_integers(item, head.n_supernode + 1) for item in (head.column, head.row_start, head.value_start)]
        places = (*starts, view_integers(head.row, head.n_row))
        layout, n_value = pack(view_doubles(head.x, head.n_value), *places)
        size = c_size_t(head.n_value)
        # The head keeps the former size, which `renew` needs again.
        head.x = self._library.cholmod_realloc(n_value, 8, head.x, byref(size), self._common)
        self._supernodes = Supernodes(view_doubles(head.x, n_value), layout, view_integers(head.order, self._n))

    def _library_solution(self, b: NDArray[np.float64]) -> NDArray[np.float64]:
        """Solution by CHOLMOD for a small or very sparse matrix, whose columns are not grouped into supernodes."""
        width = b.shape[1]
        dense = Dense(nrow=self._n, ncol=width, nzmax=b.size, leading=self._n, x=b.ctypes.data, xtype=REAL)
        answer = self._library.cholmod_solve(A_X_IS_B, self._factor, byref(dense), self._common)
        if not answer:
            raise MemoryError(f"CHOLMOD has no memory for {width} solutions of {self._n} rows")
        try:
            return view_doubles(answer.contents.x, b.size).reshape(b.shape, order="F").copy(order="F")
        finally:
            self._library.cholmod_free_dense(byref(answer), self._common)


def _order(upper: Upper) -> NDArray[np.int32] | None:
    """PARDISO's order if there are blocks: dissecting the graph of the nodes takes a quarter of CHOLMOD's time."""
    if upper.block == 1:
        return None
    try:
        return order_by_nested_dissection(upper).astype(np.int32)
    except (ImportError, OSError, RuntimeError):
        return None


def _lower(upper: Upper, *, is_pattern: bool = False) -> LowerColumns:
    """Lower triangle in the order of the matrix; a pattern may have no values."""
    if upper.block == 1:  # its rows are columns of the lower triangle
        return LowerColumns(upper.row_start, upper.column, upper.values)
    from fe.sparse.lower_columns import lower_columns

    return lower_columns(upper, is_pattern=is_pattern)


def _structure(columns: LowerColumns) -> Sparse:
    """CHOLMOD's view of a lower triangle, whose arrays must outlive it."""
    n, nnz = len(columns.start) - 1, len(columns.row)
    xtype = REAL if len(columns.values) else PATTERN
    structure = Sparse(nrow=n, ncol=n, nzmax=nnz, stype=LOWER, xtype=xtype, packed=1, sorted=0)
    structure.p, structure.i, structure.x = (item.ctypes.data for item in columns)
    return structure


def _release(shared: Any, common: Any, factor: c_void_p) -> None:
    shared.cholmod_free_factor(byref(factor), common)
    shared.cholmod_finish(common)
