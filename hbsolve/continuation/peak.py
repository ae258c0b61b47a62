r"""The interpolated resonance peak of a frequency response.

The displacement of a single damped mode has

.. math:: 1 / |q|^2 \propto (\omega_0^2 - \Omega^2)^2 + (2 \zeta \omega_0 \Omega)^2

which is exactly a parabola in Omega^2, lowest at Omega^2 = omega_0^2 (1 - 2 zeta^2): three samples, however coarse,
give its peak exactly.

Other modes bias it. Near mode 1 they add a nearly constant displacement rho a_1 / omega_1^2, with residues
a_j = phi_j,row phi_j,column and

.. math:: \rho = \sum_{j > 1} \frac{a_j}{a_1} \frac{\omega_1^2}{\omega_j^2 - \omega_1^2}, \qquad
          \delta \Omega / \omega_1 \approx -2 \zeta^2 \rho

is the shift of the peak: at 0.2 % damping 8e-6 rho. A cantilever driven near its root and measured at its tip has |rho|
of a few tenths; a row near a node of mode 1 has a large |rho|, and its peak is no measure of omega_1.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import sqrt

import numpy as np
from jaxtyping import Float

from hbsolve.errors import NoPeakError
from reduction.array_type import Real

Values = Float[Real, " p"]

#: Points of each scan: the first covers the band, each later one the two intervals beside the highest point.
SCAN = 101
#: Spacing of the last scan, relative to the half-power width: the error of the parabola is of third order in it, and
#: finer samples would only add round-off.
LAST_SCAN = 0.05
#: Largest number of scans; each is 50 times finer than the last, so that more scans mean a peak without width.
MAX_SCAN = 8


@dataclass(frozen=True, kw_only=True)
class ResonancePeak:
    """A resonance peak."""

    angular_frequency: float
    """Frequency of the peak [rad/s]."""
    amplitude: float
    """Height of the peak [unit of the response]."""
    half_power_width: float
    """Width at 1/sqrt(2) of the height, about 2 zeta omega_0 [rad/s]."""

    @property
    def frequency(self) -> float:
        """Frequency of the peak [Hz]."""
        return self.angular_frequency / (2 * np.pi)


def interpolated_peak(angular_frequency: Values, amplitude: Values) -> ResonancePeak:
    """Highest peak of a sampled response, from the parabola of 1 / amplitude^2 in Omega^2 through three samples.

    Parameters
    ----------
    angular_frequency
        Omega in any order, shape (p,) [rad/s].
    amplitude
        Amplitude of a displacement, positive, shape (p,) [any unit].

    Raises
    ------
    NoPeakError
        Fewer than three samples, or the highest is at an end, so that the samples do not enclose the peak; or a sample
        beside it is zero or at the same frequency; or the samples do not resolve the peak.
    """
    order = np.argsort(angular_frequency, kind="stable")
    omega, height = np.asarray(angular_frequency)[order], np.asarray(amplitude)[order]
    if len(omega) < 3:
        raise NoPeakError(f"{len(omega)} samples cannot enclose a peak: give at least 3")
    top = _find_enclosed_top(omega, height)
    near = slice(top - 1, top + 2)
    if not ((height[near] > 0).all() and (np.diff(omega[near]) > 0).all()):
        raise NoPeakError(
            f"the samples next to the highest one at {omega[top]:.6g} rad/s must be positive and at other "
            f"frequencies: they are {height[top - 1]:.3g} at {omega[top - 1]:.6g} and {height[top + 1]:.3g} at "
            f"{omega[top + 1]:.6g} rad/s"
        )
    peak = _fit_parabola(omega[near], height[near])
    if peak is None:
        raise NoPeakError(
            f"the samples near {omega[top]:.6g} rad/s, {omega[top + 1] - omega[top]:.3g} rad/s apart, do not resolve "
            "the peak: sample it more finely"
        )
    return peak


def resonance_peak(amplitude: Callable[[Values], Values], lowest: float, highest: float) -> ResonancePeak:
    """Highest peak of a response that can be computed at any frequency, by zooming until the parabola is exact.

    Parameters
    ----------
    amplitude
        Amplitude of a displacement at the given angular frequencies, shape (p,) [rad/s] to shape (p,).
    lowest, highest
        Band [rad/s]; it should contain one resonance, since a second, narrow one can fall between the samples.

    Raises
    ------
    NoPeakError
        The band is empty or contains no peak, or the peak has no width because it is not damped.
    """
    if not 0 <= lowest < highest:
        raise NoPeakError(f"the band from {lowest:g} to {highest:g} rad/s is empty: give its lower end first")
    for _ in range(MAX_SCAN):
        omega = np.linspace(lowest, highest, SCAN)
        height = np.asarray(amplitude(omega))
        top = _find_enclosed_top(omega, height)
        peak = _fit_parabola(omega[top - 1 : top + 2], height[top - 1 : top + 2])
        if peak is not None and omega[top + 1] - omega[top] <= LAST_SCAN * peak.half_power_width:
            return peak
        lowest, highest = omega[top - 1], omega[top + 1]
    raise NoPeakError(
        f"the peak at {omega[top]:.6g} rad/s has no width, because its height is infinite: give the mode damping"
    )


def undamped_from_peak(peak: ResonancePeak, damping_ratio: float) -> float:
    r"""Natural frequency from the displacement peak of a damped mode.

    .. math:: \omega_0 = \Omega_{\mathrm{peak}} / \sqrt{1 - 2 \zeta^2}

    Parameters
    ----------
    peak
        Peak of a displacement (velocity peaks at omega_0 itself, acceleration above it).
    damping_ratio
        zeta of that mode [-], in [0, 1/sqrt(2)): beyond, a displacement has no peak.

    Returns
    -------
    omega_0 [rad/s].

    Raises
    ------
    NoPeakError
        A damping ratio outside its range.
    """
    if not 0 <= damping_ratio < sqrt(0.5):
        raise NoPeakError(f"damping_ratio = {damping_ratio:g} must lie in [0, 0.707): 0.002 is 0.2 %")
    return peak.angular_frequency / sqrt(1 - 2 * damping_ratio**2)


def _find_enclosed_top(omega: Values, height: Values) -> int:
    """Index of the highest sample, which must have a neighbour on each side."""
    top = int(height.argmax())
    if not (0 < top < len(omega) - 1 and height[top] > 0):
        raise NoPeakError(
            f"there is no resonance peak between {omega[0]:.6g} and {omega[-1]:.6g} rad/s: the response is highest at "
            f"{omega[top]:.6g} rad/s, an end of the band; widen or move it"
        )
    return top


def _fit_parabola(omega: Values, height: Values) -> ResonancePeak | None:
    """Vertex of 1 / height^2 through three samples, the middle one highest; None if it is not above zero."""
    # Both axes are scaled, so that the parabola is computed from numbers near one.
    centre, width = omega[1] ** 2, omega[2] ** 2 - omega[0] ** 2
    x = (omega[[0, 2]] ** 2 - centre) / width
    slope_left, slope_right = ((height[1] / height[[0, 2]]) ** 2 - 1) / x
    curvature = (slope_right - slope_left) / (x[1] - x[0])
    if not curvature > 0:
        return None
    slope = slope_left - curvature * x[0]
    lowest = 1 - slope**2 / (4 * curvature)
    if not lowest > 0:
        return None
    vertex = sqrt(centre - slope / (2 * curvature) * width)
    return ResonancePeak(
        angular_frequency=vertex,
        amplitude=float(height[1]) / sqrt(lowest),
        # Half power is sqrt(lowest / curvature) from the vertex in Omega^2, and d(Omega^2) = 2 Omega dOmega.
        half_power_width=sqrt(lowest / curvature) * width / vertex,
    )
