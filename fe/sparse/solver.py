"""Factorising a sparse symmetric matrix once, and solving with it many times.

PARDISO (Cholesky or LDL^T, from the `pypardiso` wheel) where it is installed, CHOLMOD (Cholesky) where the system has
it, SuperLU from SciPy everywhere else; CHOLMOD before PARDISO where many right-hand sides are to be solved for.
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
    """Which library factorises; the first one is the fastest, but for much work."""

    PARDISO = "pardiso"
    CHOLMOD = "cholmod"
    SUPERLU = "superlu"


REMEDY = {
    Backend.PARDISO: "pip install pypardiso (x86-64 only)",
    Backend.CHOLMOD: "apt-get install libcholmod3 libopenblas0 (Debian 12), or libcholmod5 (Debian 13)",
}

#: From so many rows and right-hand sides on CHOLMOD's factor, with solutions made of its supernodes one after the
#: other, is faster than PARDISO, as long as no more threads than these share PARDISO's work.
LARGE, MANY, FEW_THREADS = 10_000, 100, 2

#: What loads each library, and fails where there is none.
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
    """The fastest that is there: PARDISO's wheel is for x86-64 only and needs MKL, CHOLMOD comes with the system.

    Parameters
    ----------
    n
        Rows of a positive definite matrix [-].
    n_column
        Right-hand sides that will come [-].
    """
    # Each is looked for when its turn comes: what is loaded decides which threads MKL will take.
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
    """Factorise a symmetric sparse matrix: both triangles of it, or what `fe.assembly.assemble_compact` returns.

    Parameters
    ----------
    matrix
        Shape (n, n).
    definiteness
        Definiteness of the matrix; Cholesky takes half the work and memory of LDL^T.
    backend
        The library, or its name; by default the fastest one that is installed. CHOLMOD's supernodes are for positive
        definite matrices: SuperLU takes an indefinite one in its place.
    n_column
        Right-hand sides that will come, about [-]: the choice of the library depends on it.

    Raises
    ------
    ValueError
        The matrix is not sparse, complex, not square, not finite or not symmetric; a definiteness that there is not.
    BackendError
        A library was asked for that this machine does not have, or that is not known.
    TooLarge
        CHOLMOD was asked for by name, or nothing else is there but SuperLU, and its 32 bits do not count the factor.
    SingularMatrix
        A pivot vanished; PARDISO and CHOLMOD also notice a negative one in a matrix declared positive definite.
        Round-off may hide either in a large matrix, so this is no proof of the contrary.
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
        # Not within the exception, which holds what CHOLMOD was given.
        return Pardiso(matrix, definiteness)
    return SuperLU(matrix.tocsr())


def _check_backend(name: Backend | str) -> Backend:
    try:
        return Backend(name)
    except ValueError:
        known = ", ".join(f'"{item.value}"' for item in Backend)
        raise BackendError(f'there is no back end "{name}": take one of {known}, or do not choose a back end') from None
