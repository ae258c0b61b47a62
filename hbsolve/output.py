"""One harmonic at an output, from the coefficients of all degrees of freedom."""

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from hbsolve.errors import BalanceError
from reduction.array_input import real_array, whole_number


def harmonic_at(
    coefficients: Complex[NDArray[np.complex128], "... harmonic r"],
    row: int | Float[NDArray[np.float64], " r"],
    harmonic: int,
) -> Complex[NDArray[np.complex128], "..."]:
    """Complex amplitude of one harmonic of a degree of freedom, or of a row over all of them [m].

    Parameters
    ----------
    coefficients
        Shape (..., H + 1, r) [m].
    row
        A degree of freedom, or shape (r,).
    harmonic
        k, from 0 to H.

    Raises
    ------
    BalanceError
        A harmonic or a degree of freedom that the coefficients do not hold, or a row of another size.
    """
    n_harmonic, n_dof = coefficients.shape[-2:]
    k = whole_number(harmonic, "harmonic", BalanceError)
    if not 0 <= k < n_harmonic:
        raise BalanceError(f"harmonic {k} is none of 0 to {n_harmonic - 1}, which the solution keeps")
    q = coefficients[..., k, :]
    if row is None or isinstance(row, str | int | float) or np.ndim(row) == 0:
        dof = whole_number(row, "row", BalanceError)
        if not 0 <= dof < n_dof:
            raise BalanceError(f"degree of freedom {dof} does not exist: the structure has 0 to {n_dof - 1}")
        return np.asarray(q[..., dof])
    weights = real_array(row, "the row", BalanceError)
    if weights.shape != (n_dof,):
        raise BalanceError(
            f"the row has shape {weights.shape}: give ({n_dof},), one weight a degree of freedom, or the number of one"
        )
    if not np.isfinite(weights).all():
        raise BalanceError(f"the row holds {weights[~np.isfinite(weights)][0]}: give finite numbers")
    return np.asarray(q @ weights)
