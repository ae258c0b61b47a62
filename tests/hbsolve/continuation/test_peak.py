"""The interpolated resonance peak."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hbsolve.continuation.peak import interpolated_peak, resonance_peak, undamped_from_peak
from hbsolve.dynamic_stiffness import DynamicStiffness
from hbsolve.errors import NoPeakError


def single(omega: np.ndarray, omega0: float = 50.0, zeta: float = 0.002) -> np.ndarray:
    return 1 / np.abs(omega0**2 - omega**2 + 2j * zeta * omega0 * omega)


@given(zeta=st.floats(1e-4, 0.3), left=st.floats(0.01, 0.9), right=st.floats(1.001, 2))
def test_three_samples_of_one_mode_give_its_peak_exactly(zeta: float, left: float, right: float) -> None:
    top = 50.0 * np.sqrt(1 - 2 * zeta**2)
    # The middle one is near the peak, the others anywhere lower.
    omega = np.array([left * top * 0.9, top * (1 + 0.1 * zeta), top * right * 1.1])
    peak = interpolated_peak(omega, single(omega, zeta=zeta))
    # The parabola spans up to (omega / half width)^2 = 1 / zeta^2, of which the vertex is a difference.
    np.testing.assert_allclose(peak.angular_frequency, top, rtol=1e-9)
    np.testing.assert_allclose(undamped_from_peak(peak, zeta), 50.0, rtol=1e-9)
    height = 1 / (2 * zeta * 50.0**2 * np.sqrt(1 - zeta**2))
    np.testing.assert_allclose(peak.amplitude, height, rtol=1e-6)


@pytest.mark.parametrize("zeta", [1e-5, 0.002, 0.05])
def test_zooming_finds_the_peak_and_its_width(zeta: float) -> None:
    peak = resonance_peak(lambda omega: single(omega, zeta=zeta), 10.0, 90.0)
    np.testing.assert_allclose(undamped_from_peak(peak, zeta), 50.0, rtol=1e-11)
    np.testing.assert_allclose(peak.amplitude, 1 / (2 * zeta * 50.0**2 * np.sqrt(1 - zeta**2)), rtol=1e-9)
    np.testing.assert_allclose(peak.half_power_width, 2 * zeta * 50.0, rtol=2 * zeta)  # to first order in zeta
    np.testing.assert_allclose(peak.frequency, peak.angular_frequency / (2 * np.pi))


def chain(n: int, zeta: float) -> tuple[DynamicStiffness, np.ndarray, np.ndarray]:
    stiffness = 1e4 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    lambda_, shapes = np.linalg.eigh(stiffness)
    damping = shapes @ np.diag(2 * zeta * np.sqrt(lambda_)) @ shapes.T
    model = DynamicStiffness(mass=np.eye(n), damping=damping, stiffness=stiffness)
    return model, np.sqrt(lambda_), shapes


@pytest.mark.parametrize(("row", "column"), [(4, 5), (3, 7), (9, 0)])
def test_with_well_separated_modes_the_peak_is_the_natural_frequency_to_1e_5(row: int, column: int) -> None:
    model, natural, _ = chain(10, 0.002)
    peak = resonance_peak(
        lambda omega: np.abs(model.receptance(omega, np.array([row]), np.array([column]))[:, 0, 0]),
        0.8 * natural[0],
        1.2 * natural[0],
    )
    np.testing.assert_allclose(undamped_from_peak(peak, 0.002), natural[0], rtol=1e-5)


@pytest.mark.parametrize(("row", "column"), [(0, 0), (3, 7), (9, 0)])
def test_neighbour_modes_bias_the_peak_as_stated(row: int, column: int) -> None:
    zeta = 0.002
    model, natural, shapes = chain(10, zeta)
    residue = shapes[row] * shapes[column]
    rho = np.sum(residue[1:] / residue[0] * natural[0] ** 2 / (natural[1:] ** 2 - natural[0] ** 2))
    peak = resonance_peak(
        lambda omega: np.abs(model.receptance(omega, np.array([row]), np.array([column]))[:, 0, 0]),
        0.8 * natural[0],
        1.2 * natural[0],
    )
    bias = undamped_from_peak(peak, zeta) / natural[0] - 1
    # First order in zeta^2 rho; the next order is zeta times smaller, neighbours' own damping as well.
    np.testing.assert_allclose(bias, -2 * zeta**2 * rho, rtol=0.02)


def test_samples_may_be_in_any_order() -> None:
    omega = np.array([40.0, 50.0, 60.0, 70.0])
    rising = interpolated_peak(omega, single(omega))
    for order in ([3, 2, 1, 0], [2, 0, 3, 1]):
        assert interpolated_peak(omega[order], single(omega[order])) == rising


def test_bands_and_samples_without_a_peak_are_refused() -> None:
    with pytest.raises(NoPeakError, match="no resonance peak between 60 and 90 rad/s: the response is highest at 60"):
        resonance_peak(single, 60.0, 90.0)
    with pytest.raises(NoPeakError, match="band from 9 to 3 rad/s is empty"):
        resonance_peak(single, 9.0, 3.0)
    with pytest.raises(NoPeakError, match="2 samples cannot enclose a peak"):
        interpolated_peak(np.array([1.0, 2.0]), np.array([1.0, 2.0]))
    with pytest.raises(NoPeakError, match="highest at 3 rad/s, an end of the band"):
        interpolated_peak(np.array([1.0, 2.0, 3.0]), np.array([1.0, 2.0, 3.0]))
    with pytest.raises(NoPeakError, match="must be positive and at other frequencies: they are 0 at 1 and 1 at 3"):
        interpolated_peak(np.array([1.0, 2.0, 3.0]), np.array([0.0, 2.0, 1.0]))
    with pytest.raises(NoPeakError, match="they are 1 at 2 and 1 at 3"):
        interpolated_peak(np.array([1.0, 2.0, 2.0, 3.0]), np.array([0.0, 1.0, 2.0, 1.0]))
    with pytest.raises(NoPeakError, match="do not resolve the peak"):
        interpolated_peak(np.array([1.0, 2.0, 3.0]), np.array([1.0, 1.0 + 1e-9, 0.01]))


def test_an_undamped_peak_has_no_height() -> None:
    with pytest.raises(NoPeakError, match="peak at 50 rad/s has no width, because"):
        resonance_peak(lambda omega: single(omega + 1e-13, zeta=0.0), 10.0, 95.0)


def test_a_damping_ratio_without_a_peak_is_refused() -> None:
    peak = interpolated_peak(np.array([40.0, 50.0, 60.0]), single(np.array([40.0, 50.0, 60.0])))
    with pytest.raises(NoPeakError, match=r"damping_ratio = 0\.71 must lie in"):
        undamped_from_peak(peak, 0.71)
