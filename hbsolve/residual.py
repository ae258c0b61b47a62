"""The harmonic-balance residual in receptance form."""

from collections.abc import Sequence

import numpy as np

from hbsolve.contact.law import ContactLaw
from hbsolve.dynamic_stiffness import DynamicStiffness
from hbsolve.fourier import Coefficients, harmonics
from hbsolve.harmonic_force import HarmonicForce


def residual(
    structure: DynamicStiffness,
    force: HarmonicForce,
    angular_frequency: float,
    coefficients: Coefficients,
    contacts: Sequence[ContactLaw] = (),
) -> Coefficients:
    r"""How far a motion is from balance, as a displacement.

    .. math:: R_k = q_k - \alpha(k \Omega) \left( f_{\mathrm{ext},k} - f_{c,k}(q) \right), \quad k = 0 \dots H

    Without contacts R is affine in q with the unit matrix as its derivative, so one Newton step from anywhere solves
    it. (Eq. 12 of the paper with K_c = 0: no contact stiffness is hidden in alpha.)

    Parameters
    ----------
    structure
        The linear structure.
    force
        The excitation f_ext.
    angular_frequency
        Omega [rad/s].
    coefficients
        The motion q, shape (n_harmonic, r) [m].
    contacts
        The contact laws; their forces add up.

    Returns
    -------
    Shape (n_harmonic, r) [m].

    Raises
    ------
    ForceError
        A static force on a body that nothing holds, or an undamped resonance.

    References
    ----------
    Ferhatoglu, Botto and Zucca, Nonlinear Dynamics (2024), eq. 12.
    """
    acting: Coefficients = force.coefficients
    for contact in contacts:
        acting = acting - contact.force(coefficients, angular_frequency)
    return np.asarray(coefficients - structure.response(harmonics(angular_frequency, force.n_harmonic), acting))
