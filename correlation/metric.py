r"""Metrics: how far a response is from another, and what a resonance peak says, as small functions.

Responses are complex amplitudes :math:`X` of :math:`e^{i \Omega t}` under a force of real amplitude :math:`F`.
"""

import numpy as np
from jaxtyping import Complex, Float
from numpy.typing import NDArray

from correlation.errors import CampaignError

Response = Complex[NDArray[np.complex128], "..."]
Metric = Float[NDArray[np.float64], "..."]


def amplitude_error(measured: Response, predicted: Response) -> Metric:
    r"""How much too large a prediction is: :math:`|X_p| / |X_m| - 1` [-], of the shape of both; 0 is perfect."""
    measured, predicted = np.asarray(measured), np.asarray(predicted)
    error: Metric = np.abs(predicted) / np.abs(measured) - 1
    return error


def phase_error(measured: Response, predicted: Response) -> Metric:
    r"""By how much a prediction leads: :math:`\arg (X_p \bar{X}_m)` [rad], in (-pi, pi]; 0 is perfect."""
    return np.angle(np.asarray(predicted) * np.conj(np.asarray(measured)))


def resonance(
    frequency: Float[NDArray[np.float64], " f"], value: Complex[NDArray[np.complex128], " f"]
) -> tuple[float, float]:
    r"""Resonance frequency [Hz] and damping ratio [-] of a peak.

    The inverse of a displacement near one mode is :math:`1/X = (\omega_0^2 - \omega^2 + 2 i \zeta \omega_0 \omega)
    \, / \, r` with a complex modal constant r. Its modulus squared is a parabola of :math:`\omega^2` whatever r is, so
    that a fit to the points around the peak gives both. Exact for one degree of freedom; for frictional damping the
    equivalent of the peak.

    Parameters
    ----------
    frequency
        Rising or falling, shape (f,) [Hz].
    value
        Displacement per unit of force or at one level, shape (f,).

    Raises
    ------
    CampaignError
        Fewer than three points, or the peak is at an end of the band.
    """
    frequency, value = np.asarray(frequency, dtype=np.float64), np.asarray(value)
    order = np.argsort(frequency)
    frequency, power = frequency[order], np.abs(value[order]) ** 2
    peak = int(np.argmax(power))
    if len(frequency) < 3 or peak in {0, len(frequency) - 1}:
        raise CampaignError(
            f"there is no resonance between {frequency.min():.6g} and {frequency.max():.6g} Hz: the response is "
            "largest at an end; measure a wider band"
        )
    # Points above a third of the peak's power, and at least its neighbours.
    near = power >= power[peak] / 3
    near[peak - 1 : peak + 2] = True
    left = peak - int(np.argmin(near[peak::-1])) if not near[: peak + 1].all() else -1
    right = peak + int(np.argmin(near[peak:])) if not near[peak:].all() else len(near)
    band = slice(left + 1, right)
    x = (frequency[band] / frequency[peak]) ** 2
    # Relative noise is alike at all points: that of 1 / power goes with 1 / power.
    a, b, c = np.polyfit(x - 1, power[peak] / power[band], 2, w=power[band] / power[peak])
    centre, floor = 1 - b / (2 * a), c - b**2 / (4 * a)
    if a <= 0 or floor <= 0 or centre <= 0:
        raise CampaignError(
            f"the peak at {frequency[peak]:.6g} Hz is no resonance of one mode; measure more points around it"
        )
    # |1/X|^2 ~ (x0 - x)^2 + 4 zeta^2 x0 x = (x - centre)^2 + floor: at x = 0 it is x0^2.
    x0 = np.sqrt(centre**2 + floor / a)
    return float(frequency[peak] * np.sqrt(x0)), float(np.sqrt(floor / a / (2 * x0 * (x0 + centre))))
