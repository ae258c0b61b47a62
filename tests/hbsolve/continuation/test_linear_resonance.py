"""A curve does not step over a resonance that the joints do not feel."""

import numpy as np
import pytest

from hbsolve.balance import HarmonicBalance
from hbsolve.continuation.linear_resonance import find_resonance_frequencies
from hbsolve.continuation.response import frequency_response
from reduction.jointed_system import JenkinsElement, JointedSystem, between

STIFFNESS, JOINT = np.array([[5e4, -2e4], [-2e4, 5e4]]), 5e3
#: The joint feels the motion against each other alone.
SHAPES = np.array([[1.0, 1.0], [1.0, -1.0]]) / np.sqrt(2)
SQUARES = np.array([3e4, 7e4 + 2 * JOINT])
FIRST, LAST = 2 * np.pi * 20, 2 * np.pi * 60


def balance(ratio: float, force: tuple[float, float], harmonic: int = 1) -> HarmonicBalance:
    slider = JenkinsElement(name="j", direction=between(2, 0, 1), tangential_stiffness=JOINT, limit_force=1e3)
    load = np.zeros((harmonic + 1, 2))
    load[harmonic] = force
    damping = SHAPES @ np.diag(2 * ratio * np.sqrt(SQUARES)) @ SHAPES.T
    system = JointedSystem(mass=np.eye(2), damping=damping, stiffness=STIFFNESS, joints=[slider], harmonic_force=load)
    return HarmonicBalance(system=system, n_harmonic=5)


@pytest.mark.parametrize("ratio", [1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("force", [(1.3, 0.7), (1.05, 0.95)])
def test_the_peak_is_that_of_the_closed_form(ratio: float, force: tuple[float, float]) -> None:
    curve = frequency_response(balance(ratio, force), FIRST, LAST)
    # Both modes stick: the sum of two resonances, one of them at its peak.
    omega = np.sqrt(SQUARES[0])
    modal = SHAPES.T @ force / (SQUARES - omega**2 + 2j * ratio * np.sqrt(SQUARES) * omega)
    # The stop in the middle is the undamped frequency, beside which the peak is by ratio^2.
    assert curve.amplitude(0).max() == pytest.approx(abs(SHAPES[0] @ modal), rel=1e-3)


def test_the_curve_stops_at_a_part_of_the_frequency_for_a_load_in_a_higher_harmonic() -> None:
    stops, _ = find_resonance_frequencies(balance(1e-3, (1.0, 1.0), harmonic=3), 20.0, 400.0)
    np.testing.assert_allclose(stops[len(stops) // 2], np.sqrt(SQUARES[0]) / 3)
    assert len(stops) == 11  # the other mode has no force


def test_neither_an_undamped_mode_nor_one_that_no_force_excites_makes_a_stop() -> None:
    assert not len(find_resonance_frequencies(balance(0.0, (1.0, 0.3)), FIRST, LAST)[0])
    stops, _ = find_resonance_frequencies(balance(1e-3, (1.0, -1.0)), FIRST, LAST)
    np.testing.assert_allclose(np.median(stops), np.sqrt(SQUARES[1]))
