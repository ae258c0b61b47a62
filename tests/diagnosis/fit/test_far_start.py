"""Starts of fits far from the vanishing strength."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.candidate.effect import EffectParameter
from diagnosis.fit.far_start import list_far_starts, list_far_strengths
from diagnosis.fit.refit import MOST_RUGGED


def test_far_strengths_of_a_ratio_are_halfway_in_logarithms() -> None:
    ratio = EffectParameter(name="ratio", unit="-", lower=0.25, upper=9.0, typical=1.1, vanishes=1.0)
    np.testing.assert_allclose(list_far_strengths(ratio), [0.25, 9.0, 0.5, 3.0], rtol=1e-15)  # rounding of roots


def test_far_strengths_of_what_vanishes_at_zero_are_halfway() -> None:
    gap = EffectParameter(name="gap", unit="m", lower=-2.0, upper=4.0, typical=0.1)
    np.testing.assert_array_equal(list_far_strengths(gap), [-2.0, 4.0, -1.0, 2.0])


def test_far_strengths_of_what_vanishes_elsewhere_than_at_zero_are_halfway_from_there() -> None:
    np.testing.assert_array_equal(list_far_strengths(WARMTH), [-5.0, 5.0, -2.0, 3.0])


RATIO = EffectParameter(name="ratio", unit="-", lower=0.25, upper=4.0, typical=1.1, vanishes=1.0)
WARMTH = EffectParameter(name="warmth", unit="K", lower=-5.0, upper=5.0, typical=2.0, vanishes=1.0)
ADDED = EffectParameter(name="added", unit="kg", lower=0.0, upper=4.0, typical=0.1)


@pytest.mark.parametrize(
    ("kind", "parameter", "joints", "is_far"),
    [
        ("friction coefficient", RATIO, ["other"], True),
        ("tangential stiffness", RATIO, ["other"], True),
        ("shift", ADDED, ["joint"], True),  # acts through stick and slip alone
        ("mass", ADDED, ["joint"], False),
        ("warm clamp", WARMTH, ["other"], False),
        ("gain", RATIO, ["joint"], False),  # its derivative tells all
    ],
)
def test_ratios_of_joints_and_effects_through_stick_and_slip_start_far(
    kind: str, parameter: EffectParameter, joints: list[str], is_far: bool
) -> None:
    changed = SimpleNamespace(system=SimpleNamespace(joints=joints))
    effect = SimpleNamespace(kind=kind, parameters=(parameter,), apply=lambda *_: changed)
    effects: Any = [effect] * (MOST_RUGGED + 1)
    model = SimpleNamespace(system=SimpleNamespace(joints=["joint"]))
    problem: Any = SimpleNamespace(fit=SimpleNamespace(values=np.array([1.5, 2.5]), model=model))
    starts = list_far_starts(problem, effects)
    assert len(starts) == (4 * MOST_RUGGED if is_far else 0)
    for effect, values in starts:
        assert effect in effects
        np.testing.assert_array_equal(values[:2], [1.5, 2.5])
