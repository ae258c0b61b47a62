r"""Metrics of responses: errors of amplitude and phase, and frequency and damping of a resonance peak.

Responses are complex amplitudes :math:`X` of :math:`e^{i \Omega t}` under a force of real amplitude :math:`F`.
"""

import numpy as np
from jaxtyping import Bool, Complex, Float
from numpy.typing import NDArray

from correlation.errors import CampaignError

Response = Complex[NDArray[np.complex128], "..."]
Metric = Float[NDArray[np.float64], "..."]


def amplitude_error(measured: Response, predicted: Response) -> Metric:
    r"""Relative amplitude error of a prediction, :math:`|X_p| / |X_m| - 1` [-], shape as both; 0 is perfect."""
    measured, predicted = np.asarray(measured), np.asarray(predicted)
    error: Metric = np.abs(predicted) / np.abs(measured) - 1
    return error


def phase_error(measured: Response, predicted: Response) -> Metric:
    r"""Phase lead of a prediction, :math:`\arg (X_p \bar{X}_m)` [rad], in (-pi, pi]; 0 is perfect."""
    return np.angle(np.asarray(predicted) * np.conj(np.asarray(measured)))


def find_peak(
    frequency: Float[NDArray[np.float64], " f"], value: Complex[NDArray[np.complex128], " f"], beside: int = 0
) -> Bool[NDArray[np.bool_], " f"]:
    """Points of a peak, shape (f,): those above a third of its power, and at least its neighbours.

    Parameters
    ----------
    frequency, value
        See `fit_resonance`.
    beside
        Number of further points on either side, if available [-].

    Raises
    ------
    CampaignError
        Fewer than three points, or the peak is at an end of the band.
    """
    order = np.argsort(frequency)
    power = np.abs(value[order]) ** 2
    peak = int(np.argmax(power))
    if len(order) < 3 or peak in {0, len(order) - 1}:
        raise CampaignError(
            f"there is no resonance between {frequency.min():.6g} and {frequency.max():.6g} Hz: the response is "
            "largest at an end; measure a wider band"
        )
    near = power >= power[peak] / 3
    near[peak - 1 : peak + 2] = True
    left = peak - int(np.argmin(near[peak::-1])) if not near[: peak + 1].all() else -1
    right = peak + int(np.argmin(near[peak:])) if not near[peak:].all() else len(near)
    result = np.zeros(len(order), dtype=bool)
    result[order[max(left + 1 - beside, 0) : right + beside]] = True
    return result


def fit_resonance(
    frequency: Float[NDArray[np.float64], " f"],
    value: Complex[NDArray[np.complex128], " f"],
    points: Bool[NDArray[np.bool_], " f"] | None = None,
) -> tuple[float, float]:
    r"""Resonance frequency [Hz] and damping ratio [-] of a peak.

    The inverse of a displacement near one mode is :math:`1/X = (\omega_0^2 - \omega^2 + 2 i \zeta \omega_0 \omega)
    \, / \, r` with a complex modal constant r. Its squared modulus is a parabola in :math:`\omega^2` for any r, so that
    a fit to the points around the peak gives both. It is exact for one degree of freedom; with friction it gives the
    equivalent values of the peak.

    Parameters
    ----------
    frequency
        Frequencies, ascending or descending, shape (f,) [Hz].
    value
        Displacement per unit of force or at one level, shape (f,).
    points
        Mask of three or more points, shape (f,); those of `find_peak` by default.

    Raises
    ------
    CampaignError
        Fewer than three points, the peak is at an end of the band, or it is not the peak of a single mode.
    """
    frequency, value = np.asarray(frequency, dtype=np.float64), np.asarray(value)
    chosen = find_peak(frequency, value) if points is None else points
    frequency, power, (a, b, c) = _fit_parabola(frequency, value, chosen)
    peak = int(np.argmax(power))
    centre, floor = 1 - b / (2 * a), c - b**2 / (4 * a)
    if a <= 0 or floor <= 0 or centre <= 0:
        raise CampaignError(
            f"the peak at {frequency[peak]:.6g} Hz is not the resonance of a single mode; measure more points around it"
        )
    # |1/X|^2 ~ (x0 - x)^2 + 4 zeta^2 x0 x = (x - centre)^2 + floor: at x = 0 it is x0^2.
    x0 = np.sqrt(centre**2 + floor / a)
    return float(frequency[peak] * np.sqrt(x0)), float(np.sqrt(floor / a / (2 * x0 * (x0 + centre))))


def measure_bend(
    frequency: Float[NDArray[np.float64], " f"],
    value: Complex[NDArray[np.complex128], " f"],
    points: Bool[NDArray[np.bool_], " f"],
) -> Float[NDArray[np.float64], " p"]:
    """Relative excess of |X| over that of the best fitting single mode at the selected points, shape (p,) [-].

    It is zero for a single mode, and for three points.
    """
    frequency, power, parabola = _fit_parabola(frequency, value, points)
    peak = int(np.argmax(power))
    x = (frequency / frequency[peak]) ** 2
    return np.asarray((np.polyval(parabola, x - 1) * power / power[peak] - 1) / 2)


def _fit_parabola(
    frequency: Float[NDArray[np.float64], " f"],
    value: Complex[NDArray[np.complex128], " f"],
    points: Bool[NDArray[np.bool_], " f"],
) -> tuple[Float[NDArray[np.float64], " p"], Float[NDArray[np.float64], " p"], Float[NDArray[np.float64], "3"]]:
    """Frequencies and |X|^2 of some points, and the parabola of 1 / |X|^2 over the squared frequency.

    Its coefficients are for frequency and power relative to those of the highest point.
    """
    frequency, power = frequency[points], np.abs(value[points]) ** 2
    peak = int(np.argmax(power))
    x = (frequency / frequency[peak]) ** 2
    # The relative noise is equal at all points, so that the noise of 1 / power is proportional to 1 / power.
    return frequency, power, np.polyfit(x - 1, power[peak] / power, 2, w=power / power[peak])
