"""Factorise a sparse symmetric matrix once and solve with it many times.

The library is PARDISO (Cholesky or LDL^T, from the `pypardiso` wheel) if it is installed, else CHOLMOD (Cholesky) if
the system has it, else SuperLU from SciPy. CHOLMOD is preferred to PARDISO for many right-hand sides.
"""

from collections.abc import Callable
from enum import Enum
from typing import Any

import scipy.sparse as sp

from fe.errors import BackendError
from fe.sparse import cholmod_library, mkl
from fe.sparse.cholmod import Cholmod
from fe.sparse.factor import Definiteness as Definiteness
from fe.sparse.factor import Factor as Factor
from fe.sparse.factor import Factorisation as Factorisation
from fe.sparse.factor import SingularMatrix as SingularMatrix
from fe.sparse.factor import Symmetric, TooLarge
from fe.sparse.factor import UnknownInertia as UnknownInertia
from fe.sparse.pardiso import Pardiso
from fe.sparse.superlu import SuperLU
from fe.sparse.symmetry import check_symmetric


class Backend(Enum):
    """Libraries for the factorisation; the first is the fastest, except for many right-hand sides."""

    PARDISO = "pardiso"
    CHOLMOD = "cholmod"
    SUPERLU = "superlu"


REMEDY = {
    Backend.PARDISO: "pip install pypardiso (x86-64 only)",
    Backend.CHOLMOD: "apt-get install libcholmod3 libopenblas0 (Debian 12), or libcholmod5 (Debian 13)",
}

#: Numbers of rows and of right-hand sides from which CHOLMOD's factor with `fe.sparse.supernodes` is faster than
#: PARDISO, and largest number of PARDISO's threads for which this holds.
LARGE, MANY, FEW_THREADS = 10_000, 100, 2

#: Function that loads each library, and fails if it is missing.
LIBRARY: dict[Backend, Callable[[], Any]] = {
    Backend.PARDISO: lambda: mkl.library(),
    Backend.CHOLMOD: lambda: cholmod_library.library(),
    Backend.SUPERLU: lambda: sp.linalg.splu,
}


def is_available(backend: Backend) -> bool:
    """Whether this machine has the library."""
    try:
        LIBRARY[backend]()
    except (ImportError, OSError):
        return False
    return True


def choose_backend(n: int = 0, n_column: int = 1) -> Backend:
    """Fastest available library: PARDISO's wheel is for x86-64 only and needs MKL, CHOLMOD comes with the system.

    Parameters
    ----------
    n
        Number of rows of a positive definite matrix [-].
    n_column
        Expected number of right-hand sides [-].
    """
    # Libraries are loaded only when needed: the libraries that are loaded determine MKL's threads.
    first = next(backend for backend in Backend if is_available(backend))
    is_much = n >= LARGE and n_column >= MANY
    if first is Backend.PARDISO and is_much and mkl.count_threads() <= FEW_THREADS and is_available(Backend.CHOLMOD):
        return Backend.CHOLMOD
    return first


def factorise(
    matrix: Symmetric,
    definiteness: Definiteness = Definiteness.POSITIVE,
    backend: Backend | str | None = None,
    n_column: int = 1,
) -> Factorisation:
    """Factorise a symmetric sparse matrix: with both triangles stored, or as `fe.assembly.assemble_compact` returns it.

    Parameters
    ----------
    matrix
        Matrix, shape (n, n).
    definiteness
        Definiteness of the matrix; Cholesky needs half the work and memory of LDL^T.
    backend
        Library or its name; by default the fastest that is installed. CHOLMOD factorises positive definite matrices
        only; SuperLU is used instead for an indefinite matrix.
    n_column
        Approximate number of right-hand sides, on which the choice of the library depends [-].

    Raises
    ------
    ValueError
        The matrix is not sparse, complex, not square, not finite or not symmetric; or the definiteness is invalid.
    BackendError
        The requested library is not installed, or unknown.
    TooLarge
        The factor exceeds the 32-bit integers of CHOLMOD, which was requested or is the only library besides SuperLU.
    SingularMatrix
        A pivot is zero; PARDISO and CHOLMOD also detect a negative pivot of a matrix declared positive definite. In a
        large matrix round-off may hide both, so that success does not prove that the matrix is regular.
    """
    check_symmetric(matrix)
    if not isinstance(definiteness, Definiteness):
        raise ValueError(f"definiteness = {definiteness!r}: take Definiteness.POSITIVE or Definiteness.INDEFINITE")
    is_positive = definiteness is Definiteness.POSITIVE
    is_open = backend is None
    if backend is None:
        backend = choose_backend(matrix.shape[0] if is_positive else 0, n_column)
    backend = _check_backend(backend)
    if not is_available(backend):
        raise BackendError(
            f'back end "{backend.value}" is not installed: {REMEDY[backend]}, or do not choose a back end'
        )
    if backend is Backend.PARDISO:
        return Pardiso(matrix, definiteness)
    if backend is Backend.CHOLMOD and is_positive:
        try:
            return Cholmod(matrix)
        except TooLarge:
            if not (is_open and is_available(Backend.PARDISO)):
                raise
        # Outside the except block, because the exception keeps CHOLMOD's data alive.
        return Pardiso(matrix, definiteness)
    return SuperLU(matrix.tocsr())


def _check_backend(name: Backend | str) -> Backend:
    try:
        return Backend(name)
    except ValueError:
        known = ", ".join(f'"{item.value}"' for item in Backend)
        raise BackendError(f'there is no back end "{name}": take one of {known}, or do not choose a back end') from None
