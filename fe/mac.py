"""Modal assurance criterion of two sets of mode shapes."""

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from geometry.errors import InputError

Shapes = Float[NDArray[np.float64], "dof mode"] | Complex[NDArray[np.complex128], "dof mode"]


def modal_assurance_criterion(
    reference: Shapes, candidate: Shapes
) -> Float[NDArray[np.float64], "reference candidate"]:
    r"""Squared cosine of the angle between every pair of mode shapes.

    .. math:: \mathrm{MAC}_{ij} = \frac{|\phi_i^H \psi_j|^2}{(\phi_i^H \phi_i)\,(\psi_j^H \psi_j)}

    It compares directions only, not frequencies; with few degrees of freedom, different modes can have high values.

    Parameters
    ----------
    reference, candidate
        Mode shapes on the same degrees of freedom, shape (n, n_mode) [any one unit each].

    Returns
    -------
    Values in [0, 1], shape (n_reference, n_candidate) [-].

    Raises
    ------
    InputError
        The two sets have different numbers of degrees of freedom.

    References
    ----------
    Allemang and Brown, A correlation coefficient for modal vector analysis, IMAC I (1982).
    """
    if reference.shape[0] != candidate.shape[0]:
        raise InputError(
            f"mode shapes on {reference.shape[0]} and {candidate.shape[0]} degrees of freedom cannot be compared: "
            "take the same rows of both"
        )
    # Columns are normalised first, so that the result is in [0, 1] up to round-off at any scale.
    phi = reference / np.linalg.norm(reference, axis=0)
    psi = candidate / np.linalg.norm(candidate, axis=0)
    cosine = np.abs(phi.conj().T @ psi)
    return np.asarray(cosine**2)
