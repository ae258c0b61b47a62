"""Frequencies that a search adds: where they are, and what a search at one frequency misses without them."""

import numpy as np
import pytest

from hbsolve.balance import HarmonicBalance
from hbsolve.errors import BalanceError
from hbsolve.limits.auxiliary_frequencies import ABOVE, BELOW, add_auxiliary_frequencies
from hbsolve.limits.objective import OutputHarmonic
from hbsolve.limits.response_limits import limit_problem, response_limits
from hbsolve.limits.search import LimitSettings
from study.case.setup import read_case
from study.shipped_cases import LIMITS
from study.solve.model import make_solve_model
from tests.slow import slow

#: Upper limits at 257 and 261 Hz lie on a branch that begins at the resonance of the sliding damper.
ASKED = 2 * np.pi * np.array([257.0, 261.0])


@pytest.fixture(scope="module")
def balance() -> HarmonicBalance:
    """Blade with a wedge damper."""
    return HarmonicBalance(system=make_solve_model(read_case(LIMITS)).system, n_harmonic=4, n_sample=64)


def test_those_asked_for_are_among_them_and_the_rest_reach_the_resonance(balance: HarmonicBalance) -> None:
    searched = add_auxiliary_frequencies(balance, ASKED, 24)
    omega = searched.angular_frequency
    assert len(omega) == 24
    np.testing.assert_array_equal(omega[searched.requested], ASKED)
    assert (np.diff(omega) > 0).all()
    assert BELOW * ASKED[0] <= omega[0] < ASKED[0]
    assert 2 * np.pi * 283 < omega[-1] <= ABOVE * ASKED[1]  # 283 Hz: all contacts stuck


def test_a_curve_of_enough_frequencies_is_searched_as_it_is(balance: HarmonicBalance) -> None:
    omega = np.linspace(1600, 1900, 24)
    searched = add_auxiliary_frequencies(balance, omega, 24)
    np.testing.assert_array_equal(searched.angular_frequency, omega)
    np.testing.assert_array_equal(searched.requested, np.arange(24))


@pytest.mark.parametrize("number", [0, pytest.param(1, marks=slow)])
def test_one_frequency_has_the_limits_of_a_curve(balance: HarmonicBalance, number: int) -> None:
    problem, settings = limit_problem(balance, OutputHarmonic(row=0)), LimitSettings(population=8, sample=0)
    curve = response_limits(problem, 2 * np.pi * np.arange(255.0, 302.0, 2), [1.0], settings=settings)
    one = response_limits(problem, ASKED[[number]], [1.0], settings=settings)
    at = int(np.abs(curve.angular_frequency - ASKED[number]).argmin())
    # Both searches end at kinks of 64 samples.
    np.testing.assert_allclose(one.value[:, 0, 0], curve.value[:, 0, at], rtol=1e-3)
    alone = response_limits(
        problem, ASKED[[number]], [1.0], settings=LimitSettings(population=8, sample=0, frequencies=1)
    )
    assert alone.upper[0, 0] < 0.7 * one.upper[0, 0]


def test_a_number_of_frequencies_below_one_is_refused() -> None:
    with pytest.raises(BalanceError, match="frequencies = 0 must be at least 1"):
        LimitSettings(frequencies=0)
