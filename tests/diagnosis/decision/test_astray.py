"""A calibration that goes astray is begun anew from the lowest level, and none else is."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from correlation.feature.vector import FeatureVector
from correlation.noise.covariance import Whitening
from correlation.prediction import Points
from diagnosis.fit import model_error_fit
from diagnosis.fit.comparison import EXCLUDED_FACTOR, Comparison
from diagnosis.fit.model_error_fit import MAX_CALIBRATION_CHI2

N = 100
LEVEL = np.array([0.1, 1.0, 3.0, 10.0])
#: A free test counts whatever its level is.
POINTS = Points(
    free=LEVEL < 1, level=LEVEL, frequency=np.ones(4), sensor=np.full(4, "tip"), harmonic=np.ones(4, dtype=np.int64)
)
HIGHER = np.array([False, False, True, True] * 2)


def calibrated(monkeypatch: pytest.MonkeyPatch, *chi2: float) -> tuple[Any, list[tuple[np.ndarray, Any]]]:
    """What comes of fits of some chi^2, and the deviations and the start of each."""
    asked, left = [], list(chi2)

    def calibrate(comparison: Comparison, _: object, start: Any, *rest: object, **more: object) -> Any:
        del rest, more
        asked.append((comparison.whitening.deviation, start))
        return SimpleNamespace(chi2=left.pop(0), n_number=N, values=f"end of {len(asked)}", prediction=None)

    monkeypatch.setattr(model_error_fit, "calibrate", calibrate)
    again = lambda comparison, fit, **more: calibrate(comparison, None, fit.values, **more)  # noqa: E731
    monkeypatch.setattr(model_error_fit, "recalibrate", again)
    features = FeatureVector.choose(POINTS, np.ones(4, dtype=np.complex128), np.ones(4, dtype=bool))
    whitening: Any = Whitening(deviation=np.arange(1.0, 9.0))
    nothing: Any = None
    comparison = Comparison(
        observed=nothing, features=features, measured=nothing, whitening=whitening, predictor=nothing, noise=nothing
    )
    start: Any = "start"
    return model_error_fit._calibrate_first(comparison, nothing, start, nothing), asked


def test_a_calibration_that_finds_the_way_is_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    result, asked = calibrated(monkeypatch, MAX_CALIBRATION_CHI2 * N)
    assert result.chi2 == MAX_CALIBRATION_CHI2 * N
    assert len(asked) == 1


@pytest.mark.parametrize(("anew", "best"), [(3.0 * N, 3.0 * N), (90.0 * N, 50.0 * N)])
def test_one_that_goes_astray_begins_where_the_lowest_level_leads(
    anew: float, best: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    result, asked = calibrated(monkeypatch, 50.0 * N, 1.0, anew)
    assert result.chi2 == best
    assert [start for _, start in asked] == ["start", "start", "end of 2"]
    whole, lowest, again = (deviation for deviation, _ in asked)
    np.testing.assert_array_equal(lowest / whole, np.where(HIGHER, EXCLUDED_FACTOR, 1.0))
    np.testing.assert_array_equal(again, whole)
