"""A fit ends neither where its model has no prediction nor beyond what its joints take, and says what is unknown."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from diagnosis.candidate.effect import EffectParameter
from diagnosis.fit.calibration import Search, calibrate, invert_curvature
from diagnosis.fit.comparison import NOT_FOUND
from diagnosis.fit.fit_parameter import Unknowns
from hbsolve.errors import ModelError
from reduction.errors import JointError

#: The truth, where the resonances end, and the largest value that the joint takes.
TRUTH, END, MOST = -0.45, -0.65, 1.0


@dataclass(frozen=True, kw_only=True)
class Softening:
    """Hands its value on; a joint cannot have a larger one."""

    name: str = "softening"
    parameters: tuple[EffectParameter, ...] = (
        EffectParameter(name="p", unit="-", lower=-0.9, upper=2.0, typical=0.1, vanishes=0.0),
    )

    def apply(self, model: Any, values: Sequence[float]) -> Any:
        del model
        (p,) = values
        if p > MOST:
            raise JointError(f"p = {p:g} is too large")
        return p


class Resonances:
    """Two frequencies, 100 and 250 Hz over the root of 1 + p, known to 0.05 and 0.1 Hz; none below `END`."""

    search = Search()

    def __init__(self, truth: float) -> None:
        self.measured, self.deviation = self._frequencies(truth), np.array([0.05, 0.1])

    def _frequencies(self, p: float) -> np.ndarray:
        return np.array([100.0, 250.0]) / np.sqrt(1 + p)

    def predict(self, model: float, nearby: object = None, starts: object = None) -> np.ndarray:
        del nearby, starts
        return self._frequencies(model) if model > END else np.full(2, np.nan)

    def residual(self, prediction: np.ndarray) -> np.ndarray:
        there = np.isfinite(prediction)
        return np.where(there, (self.measured - np.nan_to_num(prediction)) / self.deviation, NOT_FOUND)

    def has_prediction(self, prediction: np.ndarray) -> np.ndarray:
        return np.isfinite(prediction)

    def slopes(
        self, unknowns: Unknowns, values: np.ndarray, model: object, prediction: np.ndarray, first: int = 0
    ) -> np.ndarray:
        del model, first
        moved, step = unknowns.neighbour(values, 0, 0.01)
        return np.nan_to_num((self.predict(moved) - prediction) / step / self.deviation)[:, None]

    def covariance(self, residual: np.ndarray, jacobian: np.ndarray, size: np.ndarray) -> np.ndarray:
        del residual
        return invert_curvature(jacobian, size)


@pytest.mark.parametrize("truth", [TRUTH, -0.6, 0.9, MOST])
def test_a_fit_ends_where_the_data_were_made(truth: float) -> None:
    # From 0 the first step towards -0.45 leads beyond -0.65, and the slope at 1 needs a value that is refused.
    unknowns = Unknowns(base=0.0, effects=(Softening(),), prior=np.array([np.inf]))
    fit = calibrate(Resonances(truth), unknowns, np.zeros(1))
    assert fit.values[0] == pytest.approx(truth, abs=1e-3)  # `MIN_GAIN` is left


def test_what_the_data_do_not_tell_is_as_uncertain_as_its_bounds() -> None:
    unknowns = Unknowns(base=0.0, effects=(Softening(), Softening(name="again")), prior=np.full(2, np.inf))
    covariance = unknowns.limited(np.array([[1e30, 1e14], [1e14, 0.04]]))
    np.testing.assert_allclose(covariance, [[2.9**2, 2.9 * 0.1], [2.9 * 0.1, 0.04]])  # from -0.9 to 2


def test_a_model_that_takes_no_neighbour_is_refused() -> None:
    unknowns = Unknowns(base=0.0, effects=(Softening(),), prior=np.array([np.inf]))
    with pytest.raises(ModelError, match="too large"):
        unknowns.neighbour(np.array([1.5]), 0, 0.01)


@pytest.mark.parametrize("apart", [1e-3, 1e-6, 1e-7, 1e-9, 0.0])
def test_what_the_data_cannot_tell_is_uncertain(apart: float) -> None:
    one = np.array([1.0, 2.0, 3.0])
    jacobian = np.column_stack([one, one + np.array([0, 0, apart]), 1e6 * one**2, np.zeros(3)])
    deviation = np.sqrt(np.diag(invert_curvature(jacobian, np.array([1.0, 1.0, 1e-6, 0.1]))))
    # At 1e-7 the squares of the columns agree to all digits; then it is uncertain as it would be at 1e-7.
    exact = np.sqrt(np.linalg.inv(jacobian[:, :3].T @ jacobian[:, :3])[0, 0]) if apart > 1e-4 else 0.0
    assert deviation[0] > max(0.9 * exact, 1 / max(apart, 1e-6))
    assert deviation[2] < 1e-5
    assert deviation[3] > 1e5
