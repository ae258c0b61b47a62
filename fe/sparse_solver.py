"""Factorising a sparse symmetric matrix once, and solving with it many times.

PARDISO (Cholesky or LDL^T, from the `pypardiso` wheel) where it is installed, SuperLU from scipy everywhere else.
"""

import ctypes
import weakref
from enum import Enum
from functools import cache
from typing import Any, Protocol

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from numpy.typing import NDArray

Columns = Float[NDArray[np.float64], " n"] | Float[NDArray[np.float64], "n k"]


class Definiteness(Enum):
    """Which factorisation the matrix allows."""

    POSITIVE = "positive definite: Cholesky"
    INDEFINITE = "symmetric indefinite: LDL^T"


class Backend(Enum):
    """Which library factorises."""

    PARDISO = "pardiso"
    SUPERLU = "superlu"


class SingularMatrix(ArithmeticError):
    """The matrix is singular, or not positive definite where it was said to be."""


class Factor(Protocol):
    """A factorised matrix."""

    def solve(self, right_hand_side: Columns) -> Columns:
        """Solution of A x = b for one right-hand side (n,) or several (n, k)."""
        ...


def default_backend() -> Backend:
    """PARDISO if its wheel is installed (x86-64 only) and finds MKL, else SuperLU."""
    try:
        _library()
    except (ImportError, OSError):
        return Backend.SUPERLU
    return Backend.PARDISO


def factorise(
    matrix: sp.csr_array,
    definiteness: Definiteness = Definiteness.POSITIVE,
    backend: Backend | None = None,
) -> Factor:
    """Factorise a symmetric sparse matrix, both triangles given.

    Parameters
    ----------
    matrix
        Shape (n, n).
    definiteness
        What is known about the matrix; Cholesky takes half the work and memory of LDL^T.
    backend
        The library; by default the best one that is installed.

    Raises
    ------
    SingularMatrix
        A pivot vanished; PARDISO also notices a negative one in a matrix said to be positive definite. Round-off may
        hide either in a large matrix, so this is no proof of the contrary.
    """
    if (backend or default_backend()) is Backend.PARDISO:
        return _Pardiso(matrix, definiteness)
    return _SuperLU(matrix)


class _SuperLU:
    """Symmetric-mode SuperLU: the ordering keeps the symmetry, pivots stay on the diagonal unless tiny."""

    def __init__(self, matrix: sp.csr_array) -> None:
        try:
            self._lu = sp.linalg.splu(
                sp.csc_array(matrix),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.001,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            raise SingularMatrix(f"the matrix of {matrix.shape[0]} rows is singular: {error}") from error

    def solve(self, right_hand_side: Columns) -> Columns:
        return np.asarray(self._lu.solve(np.asarray(right_hand_side, dtype=np.float64)))


class _Pardiso:
    """MKL PARDISO through the wheel's low-level handle.

    The wheel's public `solve` takes both triangles (twice the memory, twice the factor time) and hashes the matrix on
    every call; the handle below factorises the upper triangle once. Parameters: Intel oneMKL reference, PARDISO iparm.
    """

    _ANALYSE_AND_FACTORISE, _SOLVE, _RELEASE = 12, 33, -1

    def __init__(self, matrix: sp.csr_array, definiteness: Definiteness) -> None:
        diagonal = matrix.diagonal()
        if definiteness is Definiteness.POSITIVE and not (diagonal > 0).all():
            raise SingularMatrix(f"the matrix of {matrix.shape[0]} rows is singular or not positive definite")
        upper = sp.csr_array(sp.triu(matrix, format="csr"))
        if not diagonal.all():
            # PARDISO wants every diagonal entry stored, zeros too, which `triu` drops.
            above, row = sp.coo_array(sp.triu(matrix, k=1)), np.arange(len(diagonal))
            values = np.concatenate([diagonal, above.data])
            places = (np.concatenate([row, above.row]), np.concatenate([row, above.col]))
            upper = sp.csr_array(sp.coo_array((values, places), shape=matrix.shape))
        upper.sort_indices()
        self._matrix = _PardisoMatrix(upper, 2 if definiteness is Definiteness.POSITIVE else -2)
        # MKL's memory is outside Python's reach; without this call each factor would stay for ever. At the end of the
        # process there is nothing left to save, and MKL may be gone already.
        weakref.finalize(self, self._matrix.call, self._RELEASE).atexit = False
        self._matrix.call(self._ANALYSE_AND_FACTORISE)

    def solve(self, right_hand_side: Columns) -> Columns:
        columns = np.asfortranarray(right_hand_side, dtype=np.float64)
        solution = np.empty_like(columns, order="F")
        self._matrix.call(self._SOLVE, columns, solution)
        return solution


@cache
def _library() -> Any:
    """The wheel's handle, made once: it searches the file system for MKL, a fifth of a second each time."""
    import pypardiso

    return pypardiso.PyPardisoSolver()


class _PardisoMatrix:
    """The matrix, parameters and memory that PARDISO works on: all that one of its calls takes."""

    _ZERO_PIVOT = -4

    def __init__(self, upper: sp.csr_array, mtype: int) -> None:
        self._n = upper.shape[0]
        self._values = np.ascontiguousarray(upper.data, dtype=np.float64)
        self._row_start = upper.indptr.astype(np.int32)
        self._column = upper.indices.astype(np.int32)
        self._mtype = mtype
        self._library = _library()
        self._memory = np.zeros(64, dtype=self._library._pt_type[1])  # addresses that PARDISO keeps between calls
        self._parameters = np.zeros(64, dtype=np.int32)
        self._parameters[0] = 1  # own parameters
        self._parameters[1] = 2  # nested dissection
        self._parameters[9] = 8  # pivots perturbed below 1e-8, for the indefinite case
        self._parameters[20] = 1  # Bunch-Kaufman pivots, for the indefinite case
        self._parameters[34] = 1  # zero-based indices

    def call(self, phase: int, b: NDArray[np.float64] | None = None, x: NDArray[np.float64] | None = None) -> None:
        """Run one phase."""

        def integer(value: int) -> Any:
            return ctypes.byref(ctypes.c_int32(value))

        def pointer(values: NDArray[Any], kind: Any) -> Any:
            return values.ctypes.data_as(ctypes.POINTER(kind))

        nothing, no_order = np.zeros(1), np.zeros(0, dtype=np.int32)
        error = ctypes.c_int32(0)
        self._library._mkl_pardiso(
            pointer(self._memory, self._library._pt_type[0]),
            integer(1),
            integer(1),
            integer(self._mtype),
            integer(phase),
            integer(self._n),
            pointer(self._values, ctypes.c_double),
            pointer(self._row_start, ctypes.c_int32),
            pointer(self._column, ctypes.c_int32),
            pointer(no_order, ctypes.c_int32),
            integer(1 if b is None or b.ndim == 1 else b.shape[1]),
            pointer(self._parameters, ctypes.c_int32),
            integer(0),
            pointer(nothing if b is None else b, ctypes.c_double),
            pointer(nothing if x is None else x, ctypes.c_double),
            ctypes.byref(error),
        )
        if error.value == self._ZERO_PIVOT:
            raise SingularMatrix(f"the matrix of {self._n} rows is singular or not positive definite")
        if error.value:
            raise RuntimeError(f"PARDISO failed in phase {phase} with error {error.value}")
