"""Interfaces of symmetric matrices and of their factors, for all libraries."""

from enum import Enum
from typing import Any, Protocol

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from numpy.typing import NDArray

#: Number of degrees of freedom of a node.
NODE = 3
#: Number of rows from which products with a few columns use compiled code.
LONG = 10_000

Columns = Float[NDArray[np.float64], " n"] | Float[NDArray[np.float64], "n k"]


class Definiteness(Enum):
    """Definiteness of a matrix, which determines its factorisation."""

    POSITIVE = "positive definite: Cholesky"
    INDEFINITE = "symmetric indefinite: LDL^T"


class SingularMatrix(ArithmeticError):
    """Error for a matrix that is singular, or not positive definite although declared to be."""


class Symmetric(Protocol):
    """Interface of a mass or stiffness: a sparse matrix, or a part of a matrix without a copy."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Numbers of rows and columns."""
        ...

    def __matmul__(self, columns: Any, /) -> Any:
        """Product with a vector (n,) or columns (n, k)."""
        ...

    def diagonal(self) -> NDArray[np.float64]:
        """Diagonal, shape (n,)."""
        ...

    def tocsr(self) -> sp.csr_array:
        """Sparse matrix in CSR form, shape (n, n)."""
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
            Right-hand sides b, which are not changed.
        out
            Array that may be overwritten with the solution, to save an allocation. It is used if it has the shape of b,
            is in Fortran order, and does not overlap b; the solution is always returned.

        Raises
        ------
        ValueError
            b is complex, or its number of rows differs from that of A.
        """
        ...


class Factorisation(Factor, Protocol):
    """Factor that can be computed again for other values, and gives the signs of its pivots."""

    def renew(self, matrix: Symmetric) -> None:
        """Factorise a matrix with other values and the same pattern, without analysing the pattern again.

        Parameters
        ----------
        matrix
            Matrix with the pattern of the first matrix, shape (n, n).

        Raises
        ------
        ValueError
            The pattern differs from the first.
        SingularMatrix
            As in `factorise`; the factor cannot be used afterwards.
        """
        ...

    @property
    def n_negative(self) -> int:
        """Number of negative eigenvalues, by Sylvester's law of inertia the number of negative pivots [-].

        Raises
        ------
        UnknownInertia
            Pivots are off the diagonal or were altered, so that their signs do not give the number.
        """
        ...


class UnknownInertia(ArithmeticError):
    """Error if the pivots of a factorisation do not give the number of negative eigenvalues."""


def singular(n: int, reason: str = "") -> SingularMatrix:
    """Error for a matrix of n rows that has no factor."""
    return SingularMatrix(f"the matrix of {n} rows is singular or not positive definite{reason}")


def check_rows(shape: tuple[int, int], columns: NDArray[Any]) -> None:
    """Raise ValueError if the length of columns differs from the number of columns of a matrix."""
    if columns.shape[0] != shape[1]:
        raise ValueError(f"a matrix of shape {shape} cannot be multiplied by columns of shape {columns.shape}")


def columns_and_place(
    shape: tuple[int, int], right_hand_side: Columns, out: Columns | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Right-hand sides and array for the solution, both in Fortran order, for all back ends.

    Returns
    -------
    Right-hand sides, and an array for the solution: `out` if a library can write to it, else a new array.

    Raises
    ------
    ValueError
        The right-hand sides are complex, or their number of rows does not match the matrix.
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
    """Error for a matrix whose number of entries exceeds the 32-bit integers of a library."""


def check_diagonal(diagonal: NDArray[np.float64]) -> None:
    """Raise SingularMatrix if a diagonal has entries that are not positive or not numbers."""
    if not (diagonal > 0).all():
        raise singular(len(diagonal))


def make_changed_pattern_error() -> ValueError:
    """Error for a matrix whose pattern differs from that of the first matrix."""
    return ValueError("the new matrix has entries in other places: factorise it separately")


class _Stored(Protocol):
    """A matrix with a known number of entries."""

    @property
    def shape(self) -> tuple[int, int]: ...

    @property
    def nnz(self) -> int: ...


def check_pattern(matrix: _Stored, shape: tuple[int, int], nnz: int) -> None:
    """Raise ValueError if shape or number of entries of a matrix differ from those of the first matrix."""
    if matrix.shape != shape or matrix.nnz != nnz:
        raise ValueError(
            f"a matrix of shape {matrix.shape} with {matrix.nnz} entries cannot take the place of one of shape "
            f"{shape} with {nnz}: factorise it separately"
        )
