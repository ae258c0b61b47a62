"""Whether matrices describe a vibrating structure."""

import warnings

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from hbsolve.errors import DampingWarning, ModelError

Matrix = Float[NDArray[np.float64], "r r"]

#: Relative asymmetry that still counts as round-off.
ASYMMETRY = 1e-9
#: Eigenvalue of the damping, relative to its largest entry or eigenvalue, that still counts as round-off.
NEGATIVE = 1e-9


def check_shape(name: str, matrix: Matrix, shape: tuple[int, ...]) -> None:
    """Refuse a matrix that is not square, not of the given shape, or not finite.

    Raises
    ------
    ModelError
        Such a matrix.
    """
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or matrix.shape != shape or not matrix.size:
        raise ModelError(
            f"the {name} has shape {matrix.shape}, the mass {shape}: give three square matrices of one size"
        )
    if not np.isfinite(matrix).all():
        row, column = np.argwhere(~np.isfinite(matrix))[0]
        raise ModelError(f"the {name} holds {matrix[row, column]} at ({row}, {column}): give finite numbers")


def check_symmetry(name: str, matrix: Matrix) -> None:
    """Refuse a matrix that is not symmetric up to round-off.

    Raises
    ------
    ModelError
        Such a matrix.
    """
    skew = np.abs(matrix - matrix.T)
    if skew.max() > ASYMMETRY * np.abs(matrix).max():
        row, column = np.unravel_index(skew.argmax(), skew.shape)
        raise ModelError(
            f"the {name} is not symmetric: entries ({row}, {column}) and ({column}, {row}) are "
            f"{matrix[row, column]:g} and {matrix[column, row]:g}"
        )


def check_mass(mass: Matrix) -> None:
    """Refuse a symmetric mass that is not positive definite.

    Raises
    ------
    ModelError
        Such a mass.
    """
    try:
        np.linalg.cholesky(mass)  # which, unlike eigenvalues, does not mind units of different size
    except np.linalg.LinAlgError:
        lightest = float(np.linalg.eigvalsh(mass)[0])
        raise ModelError(
            f"the mass has the eigenvalue {lightest:.3g} kg: the mass must be positive definite, so give every "
            "degree of freedom a mass or reduce it out"
        ) from None


def warn_of_negative_damping(damping: Matrix, stacklevel: int) -> None:
    """Warn where the symmetric part of the damping, which alone works on a motion, has a negative eigenvalue.

    Follower forces, such as those in the bearings of rotors, may be meant so: it is no error.

    Parameters
    ----------
    damping
        Finite, shape (r, r) [N s/m].
    stacklevel
        Of the line that the warning shows, as `warnings.warn` counts from here.
    """
    values = np.linalg.eigvalsh((damping + damping.T) / 2)
    largest = max(float(np.abs(values).max()), float(np.abs(damping).max()))
    if values[0] < -NEGATIVE * largest:
        warnings.warn(
            f"the damping has the eigenvalue {values[0]:.3g} N s/m in its symmetric part, whose largest is "
            f"{values[-1]:.3g} N s/m: it puts energy into a motion, as follower forces do, so check its sign if the "
            "structure is passive",
            DampingWarning,
            stacklevel=stacklevel,
        )
