"""Where refits begin, when they begin once more, and which candidates are refitted at all."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.candidate.effect import EffectParameter
from diagnosis.effect import EFFECTS
from diagnosis.fit import refit as refits
from diagnosis.fit.calibration import Ending
from diagnosis.fit.problem import EffectSelection
from diagnosis.fit.refit import (
    MAX_BY_SLIP,
    MIN_COSINE,
    MIN_GAIN_KEPT,
    MIN_GAIN_SHARE,
    choose_finalists,
    fit_from_starts,
    fit_quickly,
    shortlist,
)
from diagnosis.screening import Score

SELECTION = EffectSelection()
BY_SLIP = [kind.name for kind in EFFECTS if kind.acts_by_slip_alone]
BEST, MOST, WORTHLESS, FINALISTS, FAR_BEHIND = (
    getattr(SELECTION, name) for name in ("n_best", "n_shortlisted", "least_gain", "n_finalist", "largest_chi2_gap")
)

ACCEPTED, CHI2 = np.array([1.02, 0.97]), 500.0
#: Whitened Jacobian of the calibration parameters, with their priors' rows below.
JACOBIAN = np.arange(10.0).reshape(5, 2)


def score(
    gain: float,
    *,
    name: str = "p",
    strength: float = 0.3,
    typical: float = 1.0,
    n_parameter: int = 1,
    lower: float = -5,
    kind: str = "mass",
) -> Score:
    strengths = EffectParameter(name="p", unit="-", lower=lower, upper=5.0, typical=typical)
    rest = tuple(
        EffectParameter(name="q", unit="-", lower=0, upper=9, typical=3, vanishes=2) for _ in range(n_parameter - 1)
    )
    effect: Any = SimpleNamespace(name=name, kind=kind, parameters=(strengths, *rest))
    start = np.array([1.0, 1.0, strength, *[2.0] * (n_parameter - 1)])
    slope = np.array([7.0, 8.0, 9.0, 0.0, 0.0])
    return Score(
        effect=effect, strength=strength, gain=gain, size=1.0, absorbed=0.0, direction=slope, start=start, slope=slope
    )


class Calibrations:
    """Stands in for the fit: chi^2 of each call is given, and what it was asked is noted."""

    def __init__(self, *chi2: float) -> None:
        self.chi2, self.starts, self.slopes, self.ceilings = list(chi2), [], [], []  # type: ignore[var-annotated]

    def __call__(
        self, train: object, unknowns: object, start: np.ndarray, *_: object, slopes: Any = None,
        ending: object = None, ceiling: float = np.inf,
    ) -> Any:  # fmt: skip
        del train, unknowns
        self.ceilings.append(ceiling)
        assert ending is Ending.QUICK
        self.starts.append(np.array(start))
        self.slopes.append(slopes)
        return SimpleNamespace(chi2=self.chi2.pop(0))


def fit(of: Score, *chi2: float, monkeypatch: pytest.MonkeyPatch, n_number: int = 1000) -> tuple[Any, Calibrations]:
    calibrations = Calibrations(*chi2)
    monkeypatch.setattr(refits, "calibrate", calibrations)
    accepted = SimpleNamespace(values=ACCEPTED, jacobian=JACOBIAN, chi2=CHI2, prediction=None, n_number=n_number)
    arrangement: Any = SimpleNamespace(fit=accepted, train=None, selection=SELECTION, unknowns=lambda effects: effects)
    return fit_quickly(arrangement, of), calibrations


def test_a_fit_that_keeps_what_was_promised_is_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    promised = score(100.0)
    result, asked = fit(promised, CHI2 - 100 * MIN_GAIN_KEPT - 1, monkeypatch=monkeypatch)
    assert result.chi2 == CHI2 - 100 * MIN_GAIN_KEPT - 1
    (start,), (slopes,) = asked.starts, asked.slopes
    np.testing.assert_array_equal(start, promised.start)
    # The Jacobian that the screening knows, beside that of the calibration parameters; the effect has no prior.
    np.testing.assert_array_equal(slopes[:5, :2], JACOBIAN)
    np.testing.assert_array_equal(slopes[:5, 2], promised.slope)
    np.testing.assert_array_equal(slopes[5], 0.0)


@pytest.mark.parametrize(("strength", "typical", "second"), [(0.3, 1.0, 1.0), (-0.3, 1.0, -1.0), (0.0, -1.0, 1.0)])
def test_one_that_does_not_begins_again_from_typical_strength(
    strength: float, typical: float, second: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On the side that the screening found."""
    promised = score(100.0, strength=strength, typical=typical)
    result, asked = fit(promised, CHI2 - 10, CHI2 - 20, CHI2 - 120, monkeypatch=monkeypatch)
    assert result.chi2 == CHI2 - 120
    np.testing.assert_array_equal(asked.starts[1], promised.start)
    np.testing.assert_array_equal(asked.starts[2], [*ACCEPTED, second])
    # Far from where the slope was taken.
    assert asked.slopes[1:] == [None, None]


def test_slopes_that_lead_astray_are_taken_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the readings turn within the step to the strength of the screening."""
    promised = score(100.0)
    result, asked = fit(promised, CHI2 + 20000, CHI2 - 100 * MIN_GAIN_KEPT - 1, monkeypatch=monkeypatch)
    assert result.chi2 == CHI2 - 100 * MIN_GAIN_KEPT - 1
    np.testing.assert_array_equal(asked.starts, [promised.start, promised.start])
    assert asked.slopes[1] is None


def test_the_best_of_all_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    result, asked = fit(score(100.0), CHI2 - 60, CHI2 - 30, CHI2 - 20, monkeypatch=monkeypatch)
    assert len(asked.starts) == 3
    assert result.chi2 == CHI2 - 60


def test_a_second_start_stays_within_the_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    _, asked = fit(score(100.0, strength=-0.2, lower=-0.4), CHI2, CHI2, CHI2, monkeypatch=monkeypatch)
    np.testing.assert_array_equal(asked.starts[2], [*ACCEPTED, -0.4])


def test_effects_of_several_numbers_have_a_jacobian_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """The screening knows the slope by the strength alone."""
    _, asked = fit(score(100.0, n_parameter=2), CHI2, CHI2, monkeypatch=monkeypatch)
    assert asked.slopes == [None, None]
    np.testing.assert_array_equal(asked.starts[1], [*ACCEPTED, 1.0, 2.0])


def test_of_two_starts_of_one_effect_the_better_fit_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    calibrations = Calibrations(90.0, 300.0, 70.0)
    monkeypatch.setattr(refits, "calibrate", calibrations)
    first = SimpleNamespace(prediction=None, chi2=110.0)
    problem: Any = SimpleNamespace(fit=first, train=None, unknowns=lambda effects: effects)
    scores = [score(1.0, name=name) for name in "abcd"]
    a, b, c, _ = (item.effect for item in scores)
    fits: Any = [(scores[0], SimpleNamespace(chi2=100.0)), (scores[1], SimpleNamespace(chi2=200.0))]
    starts = [(a, np.ones(3)), (b, np.ones(3)), (c, np.array([1.0, 2.0, 3.0]))]
    result = {of.effect.name: item.chi2 for of, item in fit_from_starts(problem, scores, fits, starts)}
    # An effect that was not on the shortlist takes part; one without another start stays as it is.
    assert result == {"a": 90.0, "b": 200.0, "c": 70.0}
    assert calibrations.ceilings == [2 * 110.0] * 3
    np.testing.assert_array_equal(calibrations.starts[2], [1.0, 2.0, 3.0])


def ranked(*gains: float, alike: bool = True) -> list[Score]:
    """Best first; directions are all the same, or all across each other."""
    result = []
    for number, gain in enumerate(gains):
        direction = np.eye(len(gains))[0 if alike else number]
        plain = score(gain, name=f"p {number}")
        result.append(
            Score(
                effect=plain.effect, strength=plain.strength, gain=gain, size=1.0, absorbed=0.0, direction=direction,
                start=plain.start, slope=plain.slope,
            )
        )  # fmt: skip
    return result


def test_the_best_few_are_refitted_whatever_they_look_like() -> None:
    assert len(shortlist(ranked(100, 90, 80, 70, 60, alike=False), SELECTION)) == BEST
    assert len(shortlist(ranked(100, 90, 80, 70, 60, 50, 40, alike=False), SELECTION, is_poor=True)) == MOST


def test_what_looks_like_one_of_them_is_refitted_too_if_it_promises_enough() -> None:
    assert 0 < MIN_COSINE < 1
    few = ranked(100, 90, 80, 100 * MIN_GAIN_SHARE + 1, 100 * MIN_GAIN_SHARE - 1)
    assert [item.gain for item in shortlist(few, SELECTION)] == [100, 90, 80, 100 * MIN_GAIN_SHARE + 1]
    assert len(shortlist(ranked(*[100.0] * 20), SELECTION)) == MOST


def test_what_chance_gains_is_not_worth_a_refit() -> None:
    assert shortlist(ranked(WORTHLESS - 0.1, 1, 0), SELECTION) == []
    assert len(shortlist(ranked(WORTHLESS + 0.1, WORTHLESS - 0.1, 0), SELECTION)) == 1
    assert shortlist([], SELECTION) == []


def test_what_acts_through_slip_alone_is_refitted_in_any_case() -> None:
    """Its derivative may point the wrong way where a contact begins to slip."""
    plain = [score(gain, name=f"p {gain:g}") for gain in (100.0, 90.0, 80.0)]
    slipping = [score(0.1, name=f"line {number}", kind=BY_SLIP[0]) for number in range(MAX_BY_SLIP + 2)]
    unseen = Score(**{**vars(slipping[0]), "size": 0.0})
    assert shortlist([*plain, unseen, *slipping], SELECTION) == [*plain, *slipping[:MAX_BY_SLIP]]
    assert shortlist([*plain[:2], slipping[0]], SELECTION) == plain[:2] + slipping[:1]


def costs(fits: list[Any]) -> list[float]:
    return [fit.chi2 for _, fit in fits]


def test_those_that_fit_best_are_fitted_thoroughly() -> None:
    fits: list[Any] = [(number, SimpleNamespace(chi2=chi2)) for number, chi2 in enumerate([9.0, 3.0, 7.0, 5.0, 8.0])]
    assert [number for number, _ in choose_finalists(fits, costs(fits), SELECTION)] == [1, 3, 2][:FINALISTS]


@pytest.mark.parametrize(("behind", "kept"), [(FAR_BEHIND - 1, 3), (FAR_BEHIND + 1, 2)])
def test_a_third_that_is_far_behind_the_best_is_not_worth_it(behind: float, kept: int) -> None:
    """Behind the best, not behind the one before it."""
    fits: list[Any] = [(chi2, SimpleNamespace(chi2=chi2)) for chi2 in (100 + behind, 100.0, 100 + behind / 2)]
    result = choose_finalists(fits, costs(fits), SELECTION)
    assert [fit.chi2 for _, fit in result] == [100.0, 100 + behind / 2, 100 + behind][:kept]


def test_the_best_two_are_fitted_thoroughly_however_far_apart() -> None:
    fits: list[Any] = [(chi2, SimpleNamespace(chi2=chi2)) for chi2 in (1e3 + 10 * FAR_BEHIND, 1e3, 1e5)]
    assert [fit.chi2 for _, fit in choose_finalists(fits, costs(fits), SELECTION)] == [1e3, 1e3 + 10 * FAR_BEHIND]
    assert choose_finalists(fits[1:2], [1e3], SELECTION) == fits[1:2]
    assert choose_finalists([], [], SELECTION) == []
