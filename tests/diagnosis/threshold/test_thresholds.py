"""Thresholds by the linear theory: those of the maximum of as many chi-squares, with a margin by experience."""

import pickle
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from diagnosis.candidate.effect import EffectParameter
from diagnosis.screening import Score
from diagnosis.step import compute_step
from diagnosis.threshold.detection_threshold import (
    LEAST_UNKNOWN_FORCE_GAIN,
    LINEAR_MARGIN,
    UNKNOWN_FORCE_RATIO,
    Thresholds,
    compute_linear_thresholds,
)

BOTH = EffectParameter(name="p", unit="-", lower=-1.0, upper=1.0, typical=0.1)


def scores(directions: np.ndarray) -> list[Score]:
    effect: Any = SimpleNamespace(name="p", parameters=(BOTH,))
    return [
        Score(
            effect=effect, strength=0.0, gain=0.0, size=1.0, absorbed=0.0, direction=item, start=np.zeros(1),
            slope=item,
        )
        for item in directions
    ]  # fmt: skip


@pytest.mark.parametrize("n", [1, 30])
@pytest.mark.parametrize("false_alarms", [0.01, 0.1])
def test_the_gain_is_the_quantile_of_the_largest_of_independent_chi_squares(n: int, false_alarms: float) -> None:
    result = compute_linear_thresholds(scores(np.eye(n)), false_alarms)
    exact = chi2.ppf((1 - false_alarms) ** (1 / n), 1)
    # A quantile of 20 000 draws: a standard deviation of some 2 % at 1 %.
    assert result.gain == pytest.approx(LINEAR_MARGIN * exact, rel=0.08)
    assert result.misfit == pytest.approx(max(UNKNOWN_FORCE_RATIO * result.gain, LEAST_UNKNOWN_FORCE_GAIN))
    assert (result.false_alarms, result.n_trial) == (false_alarms, 0)
    assert LINEAR_MARGIN >= 1


def test_limits_rise_with_what_is_tried_and_with_caution() -> None:
    few, many = compute_linear_thresholds(scores(np.eye(3))), compute_linear_thresholds(scores(np.eye(40)))
    assert many.gain > few.gain
    assert compute_linear_thresholds(scores(np.eye(3)), 1e-3).gain > few.gain
    # Candidates that are all alike are one.
    alike = compute_linear_thresholds(scores(np.tile(np.eye(3)[:1], (40, 1))))
    assert alike.gain == pytest.approx(compute_linear_thresholds(scores(np.eye(1))).gain, rel=0.08)


def test_without_candidates_an_unknown_force_still_gains_by_chance() -> None:
    """Eight numbers at one of ten places, once in a hundred campaigns, beyond what eight numbers gain anyway."""
    result = compute_linear_thresholds([])
    # Model error may hide all effects at first: one alone then gains what a single parameter does.
    assert result.gain == pytest.approx(LINEAR_MARGIN * chi2.ppf(0.99, 1))
    assert result.misfit == UNKNOWN_FORCE_RATIO * result.gain
    assert pytest.approx(chi2.ppf(0.99 ** (1 / 10), 8) - 8, rel=0.05) == LEAST_UNKNOWN_FORCE_GAIN


def test_limits_travel() -> None:
    limits = Thresholds(gain=21.0, misfit=33.0, false_alarms=0.02, n_trial=40)
    assert pickle.loads(pickle.dumps(limits)) == limits


def test_by_default_nothing_is_kept() -> None:
    made = iter(range(5))
    assert [compute_step("step", lambda: next(made)) for _ in range(3)] == [0, 1, 2]
