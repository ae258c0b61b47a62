"""Starts of fits far from the vanishing strength."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.candidate.effect import EffectParameter
from diagnosis.candidate.far_strength import list_far_strengths
from diagnosis.fit import far_start
from diagnosis.fit.far_start import list_far_starts
from diagnosis.fit.refit import MAX_BY_SLIP


def test_far_strengths_of_a_ratio_are_shares_of_the_way_to_the_bounds_in_logarithms() -> None:
    ratio = EffectParameter(name="ratio", unit="-", lower=0.0625, upper=81.0, typical=1.1, vanishes=1.0)
    # up to the rounding of roots
    np.testing.assert_allclose(list_far_strengths(ratio), [[0.5, 0.25, 0.0625], [3.0, 9.0, 81.0]], rtol=1e-15)


def test_far_strengths_of_what_vanishes_at_zero_are_shares_of_the_bounds() -> None:
    gap = EffectParameter(name="gap", unit="m", lower=-2.0, upper=4.0, typical=0.1)
    np.testing.assert_array_equal(list_far_strengths(gap), [[-0.5, -1.0, -2.0], [1.0, 2.0, 4.0]])


def test_far_strengths_of_what_vanishes_elsewhere_than_at_zero_begin_there() -> None:
    np.testing.assert_array_equal(list_far_strengths(WARMTH), [[-0.5, -2.0, -5.0], [2.0, 3.0, 5.0]])


RATIO = EffectParameter(name="ratio", unit="-", lower=0.25, upper=4.0, typical=1.1, vanishes=1.0)
WARMTH = EffectParameter(name="warmth", unit="K", lower=-5.0, upper=5.0, typical=2.0, vanishes=1.0)
#: Values of the calibration parameters of the first fit.
FITTED = np.array([1.5, 2.5])
ADDED = EffectParameter(name="added", unit="kg", lower=0.0, upper=4.0, typical=0.1)


@pytest.mark.parametrize(
    ("kind", "parameter", "joints", "n_start"),
    [
        ("friction coefficient", RATIO, ["other"], 4),
        ("tangential stiffness", RATIO, ["other"], 4),
        ("shift", ADDED, ["joint"], 2),  # acts through stick and slip alone; its lower bound is the neutral value
        ("mass", ADDED, ["joint"], 0),
        ("warm clamp", WARMTH, ["other"], 0),
        ("gain", RATIO, ["joint"], 0),  # its derivative tells all
    ],
)
def test_ratios_of_joints_and_effects_through_stick_and_slip_start_far(
    kind: str, parameter: EffectParameter, joints: list[str], n_start: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        far_start, "compute_chi2", lambda _train, _unknowns, values, _near: 100 + abs(values[-1] - parameter.vanishes)
    )
    changed = SimpleNamespace(system=SimpleNamespace(joints=joints))
    effect = SimpleNamespace(kind=kind, parameters=(parameter,), apply=lambda *_: changed)
    effects: Any = [effect] * (MAX_BY_SLIP + 1)
    model = SimpleNamespace(system=SimpleNamespace(joints=["joint"]))
    starts = list_far_starts(problem_of(model), effects)
    assert len(starts) == n_start * MAX_BY_SLIP
    for item, values in starts:
        assert item in effects
        np.testing.assert_array_equal(values[:2], FITTED)


def problem_of(model: Any) -> Any:
    fit = SimpleNamespace(values=FITTED, model=model, prediction=None, chi2=100.0)
    return SimpleNamespace(fit=fit, train=None, unknowns=lambda effects: effects)


def test_to_either_side_fits_start_from_the_nearest_strength_and_the_best_other_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    model = SimpleNamespace(system=SimpleNamespace(joints=["joint"]))
    far: Any = SimpleNamespace(kind="shift", parameters=(WARMTH,), apply=lambda *_: model)
    # The bound is better than halfway below, halfway above.
    monkeypatch.setattr(far_start, "compute_chi2", lambda _train, _unknowns, values, _near: abs(values[-1] + 4.5))
    assert [values[-1] for _, values in list_far_starts(problem_of(model), [far])] == [-0.5, -5.0, 2.0, 3.0]


def test_starts_that_change_nothing_or_are_hopeless_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    model = SimpleNamespace(system=SimpleNamespace(joints=["joint"]))
    far: Any = SimpleNamespace(kind="shift", parameters=(WARMTH,), apply=lambda *_: model)
    # Below only the bound acts; above, all beyond the nearest strength is the same.
    chi2 = {-0.5: 100.0, -2.0: 1e7, -5.0: 5000.0, 2.0: 101.0, 3.0: 101.0, 5.0: np.inf}
    monkeypatch.setattr(far_start, "compute_chi2", lambda _train, _unknowns, values, _near: chi2[values[-1]])
    assert [values[-1] for _, values in list_far_starts(problem_of(model), [far])] == [-5.0, 2.0]
