r"""Effect of a window on the frequency response of a mode.

The expected cross spectrum of stationary noise under a window of duration T is that of a structure with the impulse
response :math:`h(\tau)\, r(\tau)`, where r is the autocorrelation of the window. For the Hann window, with u = tau / T,

.. math:: r = (1 - u) \left(\tfrac{2}{3} + \tfrac{1}{3} \cos 2 \pi u\right) + \tfrac{1}{2 \pi} \sin 2 \pi u

so that a pole p contributes :math:`\int_0^T r\, e^{(p - s) \tau} d\tau` instead of :math:`1 / (s - p)`: leakage. A mode
only a few lines wide appears wider, and differs from the shape of a single mode.

References
----------
Bendat and Piersol, Random Data, 4th ed., Wiley (2010), section 11.5.
Schoukens, Rolain and Pintelon, Analysis of windowing/leakage effects in frequency response function measurements,
Automatica 42 (2006) 27.
"""

from enum import Enum
from typing import Any

import numpy as np
from jaxtyping import Complex
from numpy.typing import NDArray

Differences = Complex[NDArray[np.complex128], "f m"]


class Window(Enum):
    """Window under which frequency responses were estimated."""

    NONE = "none"
    """No leakage: whole periods, bursts or decays, or stepped sines."""
    HANN = "Hann"
    """Hann window on stationary noise; the distance of lines is one over its duration."""
    UNKNOWN = "unknown"
    """Either of them: the one that explains the responses better."""


def compute_pole_response(s: Any, poles: Any, power: int, duration: float | None) -> tuple[Differences, Differences]:
    r""":math:`s^k / (s - p)` of some poles under a window, and its derivative by the pole, shape (f, m) each.

    Parameters
    ----------
    s
        i omega of the lines, shape (f, 1) [rad/s].
    poles
        Poles, shape (m,) [rad/s].
    power
        k: 0 for displacement, 1 for velocity, 2 for acceleration.
    duration
        Duration of the Hann window [s]; None for no window.
    """
    z = poles - s
    value, slope = -(s**power) / z, s**power / z**2
    if duration is None:
        return value, slope
    # s^k = p^k + a polynomial times (s - p): only the first part has a decaying response that is windowed.
    excess, excess_slope = _compute_leakage(z, duration)
    turned, turned_slope = poles**power, power * poles ** max(power - 1, 0)
    return value + turned * excess, slope + turned_slope * excess + turned * excess_slope


def _compute_leakage(z: Differences, duration: float) -> tuple[Differences, Differences]:
    r""":math:`\int_0^T r\, e^{z \tau} d\tau + 1 / z`, and its derivative by z."""
    side = 2j * np.pi / duration
    _, falling = _compute_integrals(z, duration)
    above, falling_above = _compute_integrals(z + side, duration)
    below, falling_below = _compute_integrals(z - side, duration)
    result = []
    for order in range(2):
        value = 2 / 3 * falling[order] + (falling_above[order] + falling_below[order]) / 6
        result.append(value + (above[order] - below[order]) / (4j * np.pi))
    return result[0] + 1 / z, result[1] - 1 / z**2


def _compute_integrals(
    z: Differences, duration: float
) -> tuple[tuple[Differences, Differences], tuple[Differences, Differences]]:
    r""":math:`\int_0^T e^{z \tau} d\tau` with its derivative, and the same with the factor :math:`1 - \tau / T`."""
    end = np.exp(z * duration)
    whole = (end - 1) / z
    slope = (duration * end - whole) / z
    falling = (whole - duration) / (z * duration)
    return (whole, slope), (falling, (slope / duration - falling) / z)
