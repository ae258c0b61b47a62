"""Assurance criteria of mode shapes and of frequency responses: MAC, CoMAC, FRAC, FDAC.

All are squared cosines in [0, 1]: they compare directions only and do not depend on a real or complex factor. None of
them measures frequency or amplitude, and with few sensors different modes can have high values.

References
----------
Allemang, The modal assurance criterion: twenty years of use and abuse, Sound and Vibration 37 (2003) 14.
Pascual, Golinval and Razeto, A frequency domain correlation technique for model correlation and updating, IMAC 15
(1997).
"""

from typing import Any

import numpy as np
from jaxtyping import Complex, Float, Num
from numpy.typing import NDArray

from correlation.errors import CampaignError

Shapes = Num[NDArray[Any], "sensor mode"]
Responses = Complex[NDArray[np.complex128], "sensor line"]
Criterion = Float[NDArray[np.float64], "..."]


def compute_modal_assurance(reference: Shapes, candidate: Shapes) -> Criterion:
    r"""MAC: squared cosine of the angle between every pair of mode shapes.

    .. math:: \mathrm{MAC}_{ij} = \frac{|\phi_i^H \psi_j|^2}{(\phi_i^H \phi_i)\,(\psi_j^H \psi_j)}

    Parameters
    ----------
    reference, candidate
        Mode shapes at the same sensors in the same order, shape (n_sensor, n_mode) [any one unit per mode].

    Returns
    -------
    Values in [0, 1], shape (n_reference, n_candidate) [-].

    Raises
    ------
    CampaignError
        Different numbers of sensors, or a shape of zeros.
    """
    phi, psi = (_normalise_columns(shapes) for shapes in _check_same_sensors(reference, candidate))
    return np.asarray(np.abs(phi.conj().T @ psi) ** 2)


def compute_coordinate_assurance(reference: Shapes, candidate: Shapes) -> Criterion:
    r"""CoMAC: agreement of each sensor over paired modes; low for a wrong sensor or a poorly modelled place.

    .. math:: \mathrm{CoMAC}_s = \frac{(\sum_m |\phi_{sm} \bar\psi_{sm}|)^2}{\sum_m |\phi_{sm}|^2 \sum_m |\psi_{sm}|^2}

    Parameters
    ----------
    reference, candidate
        Paired mode shapes, column by column, shape (n_sensor, n_mode); each is scaled to unit length first.

    Returns
    -------
    Values in [0, 1], shape (n_sensor,) [-]; NaN for a sensor that no mode moves.
    """
    phi, psi = (_normalise_columns(shapes) for shapes in _check_same_sensors(reference, candidate))
    if phi.shape != psi.shape:
        raise CampaignError(f"{phi.shape[1]} and {psi.shape[1]} modes are not pairs: pair them first")
    with np.errstate(invalid="ignore"):
        above = np.abs(phi * psi.conj()).sum(axis=1) ** 2
        return np.asarray(above / ((np.abs(phi) ** 2).sum(axis=1) * (np.abs(psi) ** 2).sum(axis=1)))


def compute_response_assurance(reference: Responses, candidate: Responses) -> Criterion:
    r"""FRAC: squared cosine between both responses of each sensor, over all frequencies, shape (n_sensor,) [-].

    It decreases if resonances differ, even for equal shapes.
    """
    first, second = _check_same_sensors(reference, candidate)
    return np.asarray(np.abs((_normalise_columns(first.T).conj() * _normalise_columns(second.T)).sum(axis=0)) ** 2)


def compute_domain_assurance(reference: Responses, candidate: Responses) -> Criterion:
    r"""FDAC: squared cosine between the deflection shapes at every pair of frequencies, shape (n_line, n_line) [-].

    A ridge off the diagonal indicates a frequency shift; row i is a frequency of the reference.
    """
    return compute_modal_assurance(reference, candidate)


def _check_same_sensors(reference: Shapes, candidate: Shapes) -> tuple[Shapes, Shapes]:
    first, second = np.asarray(reference), np.asarray(candidate)
    if first.ndim != 2 or second.ndim != 2 or len(first) != len(second):
        raise CampaignError(
            f"shapes {first.shape} and {second.shape} cannot be compared: give one row per "
            "sensor, the same sensors in both"
        )
    return first, second


def _normalise_columns(shapes: Shapes) -> Shapes:
    """Columns scaled to unit length, so that results lie in [0, 1] up to round-off for any scale."""
    largest = np.abs(shapes).max(axis=0)
    if not (largest > 0).all():
        raise CampaignError(f"column {int(np.argmin(largest > 0))} is zero at all sensors: leave it out")
    scaled = shapes / largest
    return np.asarray(scaled / np.linalg.norm(scaled, axis=0))
