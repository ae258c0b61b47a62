r"""A common phase offset of some curves that an error of a resonance cannot explain.

An error of frequency and damping of a resonance shifts a curve along :math:`\Omega` by a complex amount. Since
:math:`\ln X` is analytic, phases change to first order by

.. math:: \epsilon \, d \arg X / d \ln \Omega + \delta \, d \ln |X| / d \ln \Omega ,

which is zero away from the resonance, while a phase offset is constant.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int
from numpy.typing import NDArray

from correlation.data_quality.logarithm import wrap_phases

#: Least agreement of the phases after the rotation [-].
TURNED = 0.95
#: Least significant angle [rad]; least ratio of it to the error of `QUANTILE` of the phases after the rotation, and of
#: the error if each curve is shifted in frequency instead. Of 20,000 random models of one to four modes, with errors of
#: up to 20 %, over 0.3 to 30 half-widths, two pass by chance, and 45 % of those with a rotation of 10 to 90 deg do.
MIN_ANGLE, MIN_ANGLE_RATIO, MIN_SHIFT_RATIO, QUANTILE = np.radians(5.0), 5.0, 3.0, 0.9
#: Least number of points for a slope.
FEWEST = 3

Values = Complex[NDArray[np.complex128], " n"]
Angles = Float[NDArray[np.float64], " n"]


class PhaseOffset(NamedTuple):
    """Phase lead of values relative to the expected ones.

    Parameters
    ----------
    angle
        Angle [rad].
    agreement
        Agreement of the phases without the rotation: 1 for equal, -1 for opposite ones [-].
    residual
        Upper limit of most phase differences after a rotation by the angle [rad].
    """

    angle: float
    agreement: float
    residual: float


def find_phase_offset(
    value: Values, expected: Values, frequency: Float[NDArray[np.float64], " n"], curve: Int[NDArray[np.int64], " n"]
) -> PhaseOffset | None:
    """The offset that explains all phase differences; None if there is none, or if an error of a resonance may.

    Parameters
    ----------
    value, expected
        Values and expected values, shape (n,); values that are zero or not finite are left out.
    frequency
        Frequency of each value, different within a curve, shape (n,) [Hz].
    curve
        Number of the curve of each value, shape (n,).
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        apart, level = np.log(value / expected), np.log(expected)
    there = np.isfinite(apart) & np.isfinite(level)
    phase, moved, n_seen = wrap_phases(apart).imag, [], 0
    for number in np.unique(curve[there]):
        rows = np.flatnonzero(there & (curve == number))
        rows = rows[np.argsort(frequency[rows])]
        if len(rows) < FEWEST:
            there[rows] = False
            continue
        slopes = np.gradient(level[rows].real + 1j * np.unwrap(level[rows].imag), np.log(frequency[rows]))
        table = np.column_stack([slopes.imag, slopes.real])
        moved.append(phase[rows] - table @ np.linalg.lstsq(table, phase[rows], rcond=None)[0])
        n_seen += len(rows)
    if not n_seen:
        return None
    # All points have equal weight: near a resonance with an error all phases are shifted.
    together = complex(np.mean(np.exp(1j * phase[there])))
    angle = float(np.angle(together))
    left = _compute_size(np.angle(np.exp(1j * (phase[there] - angle))))
    shifted = _compute_size(np.concatenate(moved))
    clear = abs(angle) > max(MIN_ANGLE, MIN_ANGLE_RATIO * left) and shifted > max(MIN_ANGLE, MIN_SHIFT_RATIO * left)
    return PhaseOffset(angle, together.real, left) if abs(together) > TURNED and clear else None


def _compute_size(angles: Angles) -> float:
    """Quantile of the angles' magnitudes at `QUANTILE`."""
    return float(np.quantile(np.abs(angles), QUANTILE))
