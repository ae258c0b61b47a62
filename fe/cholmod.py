"""CHOLMOD of SuiteSparse, where the system has it: Cholesky in supernodes, for processors that MKL does not know.

No wheel carries it, so the system's shared library is called as it is (Debian: `libcholmod3` or `libcholmod5`). Of its
many structures only those fields are read whose places have not moved from version 3 to 5.

References
----------
Chen, Davis, Hager and Rajamanickam, Algorithm 887: CHOLMOD, ACM Trans. Math. Softw. 35 (2008) 22.
"""

import ctypes
import ctypes.util
import weakref
from ctypes import POINTER, byref, c_double, c_int, c_size_t, c_void_p
from functools import cache
from typing import Any

import numpy as np
import scipy.sparse as sp

from fe.factor import Columns, Symmetric, check_pattern, singular

#: Bytes for `cholmod_common`, of which only CHOLMOD knows the inside: 2.6 kB in version 3, some more later.
COMMON = 1 << 16
A_X_IS_B, REAL, UPPER = 0, 1, 1


class _Sparse(ctypes.Structure):
    _fields_ = [
        *((name, c_size_t) for name in ("nrow", "ncol", "nzmax")),
        *((name, c_void_p) for name in ("p", "i", "nz", "x", "z")),
        *((name, c_int) for name in ("stype", "itype", "xtype", "dtype", "sorted", "packed")),
    ]


class _Dense(ctypes.Structure):
    _fields_ = [
        *((name, c_size_t) for name in ("nrow", "ncol", "nzmax", "leading")),
        *((name, c_void_p) for name in ("x", "z")),
        *((name, c_int) for name in ("xtype", "dtype")),
    ]


class _FactorHead(ctypes.Structure):
    _fields_ = [("n", c_size_t), ("minor", c_size_t)]


class Cholmod:
    """Cholesky factor of a positive definite matrix."""

    def __init__(self, matrix: sp.csr_array) -> None:
        self._library = library()
        self._common = ctypes.create_string_buffer(COMMON)
        self._library.cholmod_start(self._common)
        self._shape, self._nnz, self._n = matrix.shape, matrix.nnz, matrix.shape[0]
        self._factor = c_void_p(None)
        weakref.finalize(self, _release, self._library, self._common, self._factor).atexit = False
        structure, _arrays = _structure(matrix)
        self._factor.value = self._library.cholmod_analyze(byref(structure), self._common)
        self._factorise(structure)

    def renew(self, matrix: Symmetric) -> None:
        """As `Factorisation.renew`."""
        matrix = matrix.tocsr()
        check_pattern(matrix, self._shape, self._nnz)
        structure, _arrays = _structure(matrix)
        self._factorise(structure)

    def solve(self, right_hand_side: Columns) -> Columns:
        """As `Factor.solve`."""
        b = np.asfortranarray(right_hand_side, dtype=np.float64)
        width = 1 if b.ndim == 1 else b.shape[1]
        dense = _Dense(nrow=self._n, ncol=width, nzmax=b.size, leading=self._n, x=b.ctypes.data, xtype=REAL)
        answer = self._library.cholmod_solve(A_X_IS_B, self._factor, byref(dense), self._common)
        if not answer:
            raise MemoryError(f"CHOLMOD has no memory for {width} solutions of {self._n} rows")
        try:
            values = ctypes.cast(answer.contents.x, POINTER(c_double))
            return np.ctypeslib.as_array(values, (width, self._n)).T.reshape(b.shape, order="F").copy(order="F")
        finally:
            self._library.cholmod_free_dense(byref(answer), self._common)

    @property
    def n_negative(self) -> int:
        """As `Factorisation.n_negative`."""
        return 0

    def _factorise(self, structure: _Sparse) -> None:
        done = self._factor.value and self._library.cholmod_factorize(byref(structure), self._factor, self._common)
        if not done:
            raise MemoryError(f"CHOLMOD has no memory for a factor of {self._n} rows")
        if ctypes.cast(self._factor, POINTER(_FactorHead)).contents.minor < self._n:
            raise singular(self._n)


def _structure(matrix: sp.csr_array) -> tuple[_Sparse, Any]:
    """CHOLMOD's view of a matrix, and the arrays that it points to; rows of a symmetric matrix are its columns."""
    n, nnz = matrix.shape[0], matrix.nnz
    start, index = matrix.indptr.astype(np.int32, copy=False), matrix.indices.astype(np.int32, copy=False)
    values = np.ascontiguousarray(matrix.data, dtype=np.float64)
    structure = _Sparse(nrow=n, ncol=n, nzmax=nnz, stype=UPPER, xtype=REAL, packed=1, sorted=matrix.has_sorted_indices)
    structure.p, structure.i, structure.x = start.ctypes.data, index.ctypes.data, values.ctypes.data
    return structure, (start, index, values)


def _release(shared: Any, common: Any, factor: c_void_p) -> None:
    shared.cholmod_free_factor(byref(factor), common)
    shared.cholmod_finish(common)


@cache
def library() -> Any:
    """The shared library.

    Raises
    ------
    OSError
        There is none.
    """
    name = ctypes.util.find_library("cholmod")
    if name is None:
        raise OSError("libcholmod was not found: apt-get install libcholmod3 (Debian 12) or libcholmod5 (Debian 13)")
    shared = ctypes.CDLL(name)
    shared.cholmod_analyze.restype = c_void_p
    shared.cholmod_solve.restype = POINTER(_Dense)
    shared.cholmod_analyze.argtypes = [c_void_p, c_void_p]
    shared.cholmod_factorize.argtypes = [c_void_p, c_void_p, c_void_p]
    shared.cholmod_solve.argtypes = [c_int, c_void_p, c_void_p, c_void_p]
    for name in ("cholmod_free_factor", "cholmod_free_dense"):
        getattr(shared, name).argtypes = [c_void_p, c_void_p]
    for name in ("cholmod_start", "cholmod_finish"):
        getattr(shared, name).argtypes = [c_void_p]
    # It would print that a matrix is not positive definite; the exception says so.
    try:
        shared.SuiteSparse_config_printf_func_set(None)
    except AttributeError:  # before SuiteSparse 7 a structure of functions, the fifth of which prints
        (c_void_p * 5).in_dll(shared, "SuiteSparse_config")[4] = None
    return shared
