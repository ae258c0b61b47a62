"""A jitter beyond the first order: one mode for all states where a response is smooth, one for each state at a kink."""

from collections.abc import Callable
from math import sqrt
from typing import Any

import numpy as np
import pytest

from correlation.feature.vector import FeatureVector
from correlation.noise.kink import (
    NEGLIGIBLE_REMAINDER,
    NODE,
    NODE_WEIGHT,
    JitterShift,
    Remainder,
    compute_remainder,
    make_curvature_modes,
    make_kink_modes,
)
from correlation.noise.nuisance import ModelFeatures
from correlation.prediction import Points, Prediction

#: Three states of two mean forces each: their features are the readings themselves.
N_STATE, N_SENSOR = 3, 2
STATE = np.repeat(np.arange(N_STATE), N_SENSOR)
NOMINAL = np.array([3.0, -1.0, 4.0, 1.0, -5.0, 9.0])
SLOPE = np.array([0.5, 2.0, -1.0, 0.3, 0.7, -0.2])
#: What bends: different at each number, and of either sign.
BENT = np.array([1.0, -2.0, 3.0, 0.5, -1.5, 2.5])
#: Standard deviation of the jitter of one repeat, and repeats in a mean.
JITTER, N_REPEAT = 0.3, 4.0
#: Deviation of the noise: next to nothing, so that every remainder is seen.
QUIET = np.full(len(STATE), 1e-9)

Response = Callable[[float], np.ndarray]


class Told:
    """Stands in for a predictor: its models are the jitter itself."""

    def __init__(self, points: Points, response: Response) -> None:
        self.points, self.response = points, response

    def predict(self, model: Any, before: Prediction | None = None) -> Prediction:
        del before
        return Prediction(points=self.points, value=self.vary(model), states={})

    def vary(self, model: Any, before: Prediction | None = None) -> np.ndarray:
        del before
        return self.response(float(model)).astype(np.complex128)


def made(response: Response) -> ModelFeatures:
    k = len(STATE)
    points = Points(
        free=np.zeros(k, dtype=bool), level=np.ones(k), frequency=20.0 + STATE.astype(float),
        sensor=np.tile(["left_N", "right_N"], N_STATE), harmonic=np.zeros(k, dtype=np.int64),
    )  # fmt: skip
    prediction = Told(points, response).predict(0.0)
    features = FeatureVector.choose(points, prediction.value, np.zeros(k, dtype=bool))
    predictor: Any = Told(points, response)
    return ModelFeatures(predictor, features, predictor, prediction)


def shift(slope: np.ndarray) -> JitterShift:
    ends: Any = (NODE * JITTER, -NODE * JITTER)
    return JitterShift(models=ends, halves=(ends[0] / 2, ends[1] / 2), change=slope * ends[0])


def remainders_of(response: Response, *slopes: np.ndarray) -> list[Remainder]:
    nominal = made(response)
    return [compute_remainder(nominal, shift(item)) for item in slopes]


def modes_of(response: Response, *slopes: np.ndarray, deviation: np.ndarray = QUIET, n: float = N_REPEAT) -> np.ndarray:
    kinks = [item.kink for item in remainders_of(response, *slopes)]
    return np.asarray(make_kink_modes(made(response).features.state, kinks, deviation, n))


def test_a_linear_response_has_none() -> None:
    # Round-off is 1e-15, a millionth of the noise.
    assert modes_of(lambda x: NOMINAL + SLOPE * x, SLOPE).shape == (len(STATE), 0)


def test_without_causes_there_are_none() -> None:
    assert modes_of(lambda x: NOMINAL + BENT * x**2).shape == (len(STATE), 0)


@pytest.mark.parametrize("n", [1.0, 4.0, 12.0])
@pytest.mark.parametrize("cubic", [0.0, 2.0])
def test_a_smooth_response_has_those_of_the_closed_form(n: float, cubic: float) -> None:
    """Either end departs by x^2 (c + d x) at x = +-sqrt(3) s, and counts for a sixth in the variance / n and mean."""

    def response(x: float) -> np.ndarray:
        return NOMINAL + SLOPE * x + BENT * x**2 * (1 + cubic * x)

    assert modes_of(response, SLOPE, n=n).shape == (len(STATE), 0)
    (result,) = remainders_of(response, SLOPE)
    modes = make_curvature_modes([result.smooth], np.zeros(len(STATE), dtype=bool), n)
    for mode, x in zip(modes.T, (NODE * JITTER, -NODE * JITTER), strict=True):
        expected = sqrt(1 / (6 * n) + 1 / 36) * BENT * x**2 * (1 + cubic * x)
        # Round-off of sums of the size of the nominal response.
        np.testing.assert_allclose(mode, expected, rtol=0, atol=1e-13)
    if not cubic:
        # Together: E d^2 = 3 c^2 s^4 of a normal x, which a rule of three points has exactly, over n; and twice half
        # the mean c s^2, which is that of each end.
        total = (modes**2).sum(axis=1)
        np.testing.assert_allclose(total, (3 / n + 1 / 2) * (BENT * JITTER**2) ** 2, rtol=1e-10)


def test_a_sharp_resonance_is_smooth_while_the_jitter_is_less_than_its_width() -> None:
    """X = 1 / (1 + i x), whose series in x converges slowly: of each test one mode for all states, and no kink."""
    offset = np.repeat([-1.5, 0.0, 1.5], N_SENSOR)
    width = NODE * JITTER / 0.5

    def response(x: float) -> np.ndarray:
        return np.asarray((1 / (1 + 1j * (offset + x / width))).real)

    slope = (response(1e-6) - response(-1e-6)) / 2e-6
    assert modes_of(response, slope).shape == (len(STATE), 0)


@pytest.mark.parametrize("side", ["sticks", "slips"])
def test_a_kink_at_one_state_has_a_mode_of_this_state_alone(side: str) -> None:
    """Slip begins at no jitter at all: the derivative is that of one side, and the other side departs from it."""
    here = STATE == 1
    known = SLOPE + (BENT * here if side == "slips" else 0.0)
    modes = modes_of(lambda x: NOMINAL + SLOPE * x + BENT * here * max(x, 0.0), known)
    (mode,) = modes.T
    expected = sqrt(NODE_WEIGHT / N_REPEAT + NODE_WEIGHT**2) * NODE * JITTER * BENT
    # Round-off.
    np.testing.assert_allclose(mode, np.where(here, expected, 0.0), rtol=0, atol=1e-13)


def test_each_cause_has_modes_of_its_own() -> None:
    """Independent causes add up in the covariance."""
    once = modes_of(lambda x: NOMINAL + BENT * abs(x), 0 * SLOPE)
    twice = modes_of(lambda x: NOMINAL + BENT * abs(x), 0 * SLOPE, 0 * SLOPE)
    np.testing.assert_array_equal(twice, np.column_stack([once, once]))


@pytest.mark.parametrize(("times", "seen"), [(1.01, True), (0.99, False)])
def test_what_the_noise_hides_is_left_out(times: float, seen: bool) -> None:
    """All numbers of a state together: each of its two is below the limit by itself."""
    here = STATE == 2
    size = sqrt(NODE_WEIGHT / N_REPEAT + NODE_WEIGHT**2) * NODE * JITTER * np.abs(BENT)
    deviation = np.where(here, size * sqrt(N_SENSOR) / (NEGLIGIBLE_REMAINDER * times), 1e9)
    modes = modes_of(lambda x: NOMINAL + BENT * abs(x), 0 * SLOPE, deviation=deviation)
    assert modes.shape[1] == (2 if seen else 0)
    assert not modes[~here].any()


@pytest.mark.parametrize("lost", [[0, 1], [0]])
def test_what_is_not_found_has_none_and_spoils_no_other(lost: list[int]) -> None:
    """A whole state, or one number of it, at one end."""
    here = np.isin(np.arange(len(STATE)), lost)
    whole = modes_of(lambda x: NOMINAL + BENT * abs(x), 0 * SLOPE)
    modes = modes_of(lambda x: np.where(here & (x > 0), np.nan, NOMINAL + BENT * abs(x)), 0 * SLOPE)
    whole[here, 0] = 0.0
    np.testing.assert_array_equal(modes, whole[:, whole.any(axis=0)])
