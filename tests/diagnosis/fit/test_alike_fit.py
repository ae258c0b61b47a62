"""Fits of effects that do the same as the best one: those that missed its minimum begin where its fit ended."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.candidate.effect import EffectParameter
from diagnosis.fit import alike_fit
from diagnosis.fit.alike_fit import fit_alike, list_starts_alike
from diagnosis.fit.problem import EffectSelection
from diagnosis.screening import Score
from diagnosis.step import compute_step, remember_steps

SELECTION = EffectSelection()
FITTED = np.array([1.02, 0.97])
#: chi^2 of the fit without an effect.
BEFORE = 1000.0


def score(name: str, angle: float, *, size: float = 1.0, typical: float = 1.5, vanishes: float = 1.0) -> Score:
    """An effect whose change has this angle to an axis [rad]."""
    parameter = EffectParameter(name="p", unit="-", lower=0.1, upper=10.0, typical=typical, vanishes=vanishes)
    effect: Any = SimpleNamespace(name=name, parameters=(parameter,))
    direction = np.array([np.cos(angle), np.sin(angle)])
    return Score(
        effect=effect,
        strength=1.0,
        gain=1.0,
        size=size,
        absorbed=0.0,
        direction=direction,
        start=FITTED,
        slope=direction,
    )


def fit(chi2: float, strength: float = 0.6) -> Any:
    return SimpleNamespace(chi2=chi2, values=np.array([1.1, 0.9, strength]), prediction=None)


@pytest.fixture
def problem(monkeypatch: pytest.MonkeyPatch) -> Any:
    # The nearer the strength is to 0.65, the better.
    monkeypatch.setattr(alike_fit, "compute_chi2", lambda _train, _unknowns, begin, _nearby: abs(begin[2] - 0.65))
    first = SimpleNamespace(values=FITTED, chi2=BEFORE)
    return SimpleNamespace(fit=first, train=None, selection=SELECTION, unknowns=lambda effects: effects)


def test_an_effect_that_does_the_same_begins_where_the_best_fit_ended(problem: Any) -> None:
    best, missed = score("best", 0.0, size=2.0), score("missed", np.pi + 1e-3)
    fits = [(best, fit(300.0, strength=1.2)), (missed, fit(400.0))]
    ((effect, start),) = list_starts_alike(problem, [best, missed], fits, best, fits[0][1])
    assert effect is missed.effect
    # 0.2 of 0.5, times 2, to the other side is 0.6, which is nearer than strengths from afar.
    np.testing.assert_allclose(start, [1.1, 0.9, 0.6], rtol=1e-12)


@pytest.mark.parametrize(("angle", "chi2", "again"), [
    (0.0, 302.0, False),  # as good as the best
    (0.0, 304.0, True),
    (0.1, 309.0, False),  # it may be behind by 7.0 and the least gain
    (0.1, 311.0, True),
    (0.1, None, True),  # not fitted at all
    (0.3, None, False),  # too far behind to be a finalist
    (np.pi / 2, None, False),  # another effect altogether
])  # fmt: skip
def test_only_what_is_further_behind_than_its_direction_allows_begins_again(
    problem: Any, angle: float, chi2: float | None, again: bool
) -> None:
    best, other = score("best", 0.0), score("other", angle)
    fits = [(best, fit(300.0))] + ([] if chi2 is None else [(other, fit(chi2))])
    assert len(list_starts_alike(problem, [best, other], fits, best, fits[0][1])) == again


def test_the_nearest_few_begin_again(problem: Any) -> None:
    best, others = score("best", 0.0), [score(f"{angle}", angle) for angle in (0.04, 0.01, 0.03, 0.02, 0.05)]
    result = list_starts_alike(problem, [best, *others], [(best, fit(300.0))], best, fit(300.0))
    assert [effect.name for effect, _ in result] == ["0.01", "0.02", "0.03"][: SELECTION.n_finalist]


def test_of_a_small_gain_other_effects_are_not_alike(problem: Any) -> None:
    best, others = score("best", 0.0), [score(f"{angle}", angle) for angle in (0.5, 1.0, np.pi / 2)]
    assert list_starts_alike(problem, [best, *others], [(best, fit(995.0))], best, fit(995.0)) == []


def test_nothing_begins_again_where_no_effect_gains(problem: Any) -> None:
    best, other = score("best", 0.0), score("other", 0.0)
    assert list_starts_alike(problem, [best, other], [(best, fit(BEFORE))], best, fit(BEFORE)) == []
    assert fit_alike(problem, [best, other], []) == []


@pytest.mark.parametrize("run_step", [compute_step, remember_steps(compute_step)], ids=["computed", "remembered"])
def test_what_becomes_the_best_is_followed_once_more(
    problem: Any, run_step: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    ends, asked = {"a": iter([252.0]), "b": iter([250.0]), "c": iter([260.0, 251.0])}, []

    def fit_from(_problem: Any, effect: Any, _start: Any, _nearby: Any, **_: Any) -> Any:
        asked.append(effect.name)
        return fit(next(ends[effect.name]))

    monkeypatch.setattr("diagnosis.fit.refit.fit_from", fit_from)
    a, b, c = (score(name, 0.0) for name in "abc")
    result = {
        item.effect.name: one.chi2
        for item, one in fit_alike(problem, [a, b, c], [(a, fit(300.0)), (b, fit(320.0))], run_step)
    }
    # Both begin like a; b becomes the best, and then a and c begin like it.
    assert asked[:2] == ["b", "c"]
    assert asked[2:] == ["a", "c"]
    assert result == {"a": 252.0, "b": 250.0, "c": 251.0}
