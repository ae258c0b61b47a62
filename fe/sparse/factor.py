"""Interfaces of symmetric matrices and of their factors, for all libraries."""

from enum import Enum
from typing import Any, Protocol

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from numpy.typing import NDArray

#: Degrees of freedom of a node.
NODE = 3
#: From so many rows on, products with a few columns are our own, which a compiler is imported for.
LONG = 10_000

Columns = Float[NDArray[np.float64], " n"] | Float[NDArray[np.float64], "n k"]


class Definiteness(Enum):
    """Definiteness of a matrix, which decides on its factorisation."""

    POSITIVE = "positive definite: Cholesky"
    INDEFINITE = "symmetric indefinite: LDL^T"


class SingularMatrix(ArithmeticError):
    """The matrix is singular, or not positive definite where it was declared to be."""


class Symmetric(Protocol):
    """Interface of a mass or a stiffness: a sparse matrix, or a part of one without a copy."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Rows and columns."""
        ...

    def __matmul__(self, columns: Any, /) -> Any:
        """Product with a vector (n,) or columns (n, k)."""
        ...

    def diagonal(self) -> NDArray[np.float64]:
        """The diagonal, shape (n,)."""
        ...

    def tocsr(self) -> sp.csr_array:
        """As a sparse matrix, shape (n, n)."""
        ...

    def toarray(self) -> NDArray[np.float64]:
        """All entries, shape (n, n)."""
        ...


class Factor(Protocol):
    """A factorised matrix."""

    def solve(self, right_hand_side: Columns, out: Columns | None = None) -> Columns:
        """Solution of A x = b for one right-hand side (n,) or several (n, k).

        Parameters
        ----------
        right_hand_side
            b; it stays as it is.
        out
            May be written over to hold the solution, as fresh memory costs time: used where it has the shape of b, in
            Fortran order, and does not overlap b; what is returned holds the solution in any case.

        Raises
        ------
        ValueError
            b is complex, or has another number of rows than A.
        """
        ...


class Factorisation(Factor, Protocol):
    """A factor that can be computed again for other values, and gives the signs of its pivots."""

    def renew(self, matrix: Symmetric) -> None:
        """Factorise other values in the same places; what is known about the places is not found out again.

        Parameters
        ----------
        matrix
            Shape (n, n), with the pattern of the first one.

        Raises
        ------
        ValueError
            The pattern is another one.
        SingularMatrix
            As `factorise`; the factor is of no use afterwards.
        """
        ...

    @property
    def n_negative(self) -> int:
        """Eigenvalues below zero [-]: by Sylvester's law of inertia, negative pivots.

        Raises
        ------
        UnknownInertia
            Pivots had to be taken from beside the diagonal, or were altered: their signs prove nothing.
        """
        ...


class UnknownInertia(ArithmeticError):
    """The pivots of this factorisation do not give the number of negative eigenvalues."""


def singular(n: int, reason: str = "") -> SingularMatrix:
    """The error for a matrix of n rows that has no factor."""
    return SingularMatrix(f"the matrix of {n} rows is singular or not positive definite{reason}")


def check_rows(shape: tuple[int, int], columns: NDArray[Any]) -> None:
    """Raise ValueError where columns are longer or shorter than a matrix has columns."""
    if columns.shape[0] != shape[1]:
        raise ValueError(f"a matrix of shape {shape} cannot be multiplied by columns of shape {columns.shape}")


def columns_and_place(
    shape: tuple[int, int], right_hand_side: Columns, out: Columns | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Right-hand side and result array of every back end, both in Fortran order.

    Returns
    -------
    Right-hand sides, and an array for the solution: the one offered, if a library can write there, or a fresh one.

    Raises
    ------
    ValueError
        The right-hand sides are complex, or have another number of rows than the matrix of this shape.
    """
    if np.iscomplexobj(right_hand_side):
        raise ValueError("right-hand sides are complex: solve for their real and their imaginary parts")
    b = np.asfortranarray(right_hand_side, dtype=np.float64)
    check_rows(shape, b)
    if (
        out is not None
        and out.shape == b.shape
        and out.dtype == np.float64
        and out.flags.f_contiguous
        and out.flags.writeable
        and not np.may_share_memory(out, b)
    ):
        return b, np.asarray(out)
    return b, np.empty(b.shape, order="F")


class TooLarge(MemoryError):
    """The library counts in 32 bits, and this matrix has more."""


def check_diagonal(diagonal: NDArray[np.float64]) -> None:
    """Raise SingularMatrix where a diagonal is not that of a positive definite matrix, or holds what is no number."""
    if not (diagonal > 0).all():
        raise singular(len(diagonal))


def make_changed_pattern_error() -> ValueError:
    """The error for a matrix whose sparsity pattern is not that of the matrix analysed first."""
    return ValueError("the new matrix has entries in other places: factorise it separately")


class _Stored(Protocol):
    """A matrix with a known number of entries."""

    @property
    def shape(self) -> tuple[int, int]: ...

    @property
    def nnz(self) -> int: ...


def check_pattern(matrix: _Stored, shape: tuple[int, int], nnz: int) -> None:
    """Raise ValueError where a matrix visibly has other places than the one analysed first."""
    if matrix.shape != shape or matrix.nnz != nnz:
        raise ValueError(
            f"a matrix of shape {matrix.shape} with {matrix.nnz} entries cannot take the place of one of shape "
            f"{shape} with {nnz}: factorise it separately"
        )
