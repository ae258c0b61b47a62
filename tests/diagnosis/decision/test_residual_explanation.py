"""After the right effect little is left to explain; after a wrong one the right one, or a force where it acts, is."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.candidate.catalogue import Catalogue
from diagnosis.decision import residual_explanation
from diagnosis.decision.residual_explanation import MAX_FURTHER_FITS, ResidualExplanation, add_effect, explain_residual
from diagnosis.fit.arrangement import Arrangement
from diagnosis.fit.problem import Refit
from diagnosis.fit.refit import fit_quickly, make_baseline_refit, refit
from diagnosis.screening import Score, compute_slope_gains, screen
from diagnosis.threshold.detection_threshold import Thresholds, compute_linear_thresholds
from diagnosis.unknown_force import compute_excess_gain

#: What `heavy` hides, and what it does not.
RIGHT, WRONG = "mass at tip z", "mass at root z"


@pytest.fixture(scope="module")
def scores(heavy: Arrangement, listed: Catalogue) -> dict[str, Score]:
    return {score.effect.name: score for score in screen(heavy, listed.candidates)}


@pytest.fixture(scope="module")
def refits(heavy: Arrangement, scores: dict[str, Score]) -> dict[str, Refit]:
    return {name: refit(heavy, scores[name]) for name in (RIGHT, WRONG)}


@pytest.fixture(scope="module")
def left(heavy: Arrangement, listed: Catalogue, refits: dict[str, Refit]) -> dict[str, ResidualExplanation]:
    return {name: explain_residual(add_effect(heavy, item), listed.candidates, np.inf) for name, item in refits.items()}


@pytest.fixture(scope="module")
def limits(scores: dict[str, Score]) -> Thresholds:
    return compute_linear_thresholds(list(scores.values()))


def test_after_the_right_effect_chance_alone_is_left(left: dict[str, ResidualExplanation], limits: Thresholds) -> None:
    assert left[RIGHT].gain < limits.gain
    assert compute_excess_gain(left[RIGHT].places[0]) < limits.misfit


def test_after_a_wrong_effect_a_good_part_is_left(
    left: dict[str, ResidualExplanation], limits: Thresholds, heavy: Arrangement, refits: dict[str, Refit]
) -> None:
    rest = left[WRONG]
    # A mass elsewhere shifts the resonance as well, and cannot have the shape right.
    assert rest.gain > 10 * limits.gain
    assert compute_excess_gain(rest.places[0]) > 10 * limits.misfit
    assert rest.places[0].name == "tip z"
    # It explains nearly all that an unknown force of a stiffness per level does.
    assert rest.known_effect_gain > 0.8 * rest.places[0].gain
    # What is left, put on top, is about what the right one explains in all; its share is linear and the rest is not.
    before = make_baseline_refit(heavy)
    whole = before.fit.chi2 - refits[RIGHT].fit.chi2
    assert before.fit.chi2 - refits[WRONG].fit.chi2 + rest.gain == pytest.approx(whole, rel=0.15)


def test_the_accepted_effect_counts_as_added(heavy: Arrangement, refits: dict[str, Refit]) -> None:
    accepting = add_effect(heavy, refits[RIGHT])
    assert [item.name for item in accepting.added] == [RIGHT]
    assert accepting.fit.chi2 == refits[RIGHT].fit.chi2
    # Its Jacobian is that of the end, whatever updates the fit went by.
    fit, step = accepting.fit, 1e-5
    for number, size in enumerate(fit.unknowns.size):
        ends = []
        for side in (-1, 1):
            values = np.array(fit.values)
            values[number] += side * step * size
            ends.append(heavy.train.residual(heavy.train.predict(fit.unknowns.compose(values), fit.prediction)))
        exact = -(ends[1] - ends[0]) / (2 * step * size)
        # Newton's 1e-9 over the step, and curvature.
        np.testing.assert_allclose(fit.jacobian[: len(exact), number], exact, rtol=0, atol=3e-4 * np.abs(exact).max())


def test_the_accepted_effect_itself_has_nothing_more_to_give(
    heavy: Arrangement, refits: dict[str, Refit], listed: Catalogue
) -> None:
    (more,) = compute_slope_gains(add_effect(heavy, refits[RIGHT]), [listed.effect(RIGHT)])
    # It is among what is projected out.
    assert more < 0.1


def test_gains_by_slope_are_those_of_screening_where_effects_are_weak(
    heavy: Arrangement, scores: dict[str, Score], listed: Catalogue
) -> None:
    gains = compute_slope_gains(heavy, listed.candidates)
    for effect, result in zip(listed.candidates, gains, strict=True):
        assert result >= 0
        if effect.kind in {"gain", "density"}:
            # Linear, but for the curvature of the resonance; screening tries the strength itself.
            assert result == pytest.approx(scores[effect.name].gain, rel=0.1, abs=1)


def test_without_candidates_no_effect_is_left(heavy: Arrangement, refits: dict[str, Refit]) -> None:
    rest = explain_residual(add_effect(heavy, refits[RIGHT]), [], np.inf)
    assert (rest.gain, rest.effect_name) == (0.0, "")
    assert rest.places


def test_a_refit_begins_where_screening_ends(heavy: Arrangement, scores: dict[str, Score]) -> None:
    """The calibration parameters make up for the effect, so that chi^2 at the start has fallen by the gain already."""
    score, fit = scores[RIGHT], heavy.fit
    assert score.start[-1] == score.strength
    unknowns = heavy.unknowns([score.effect])
    there = heavy.train.residual(heavy.train.predict(unknowns.compose(score.start), fit.prediction))
    prior = (score.start - unknowns.vanishing) / unknowns.prior
    chi2 = there @ there + prior @ prior
    # The screening is linear: 2 % of curvature over 0.3 % of the frequency.
    assert fit.chi2 - chi2 == pytest.approx(score.gain, rel=0.05)
    # The accepted values alone, with the same strength, gain less.
    alone = np.array([*fit.values, score.strength])
    apart = heavy.train.residual(heavy.train.predict(unknowns.compose(alone), fit.prediction))
    assert apart @ apart > there @ there


@pytest.mark.parametrize("name", [RIGHT, "dashpot at tip z", "preload of left", "gain of root"])
def test_the_slope_of_a_score_is_the_derivative_at_none(
    heavy: Arrangement, scores: dict[str, Score], name: str
) -> None:
    score, fit = scores[name], heavy.fit
    parameter, ends = score.effect.parameters[0], []
    step = 3e-4 * abs(parameter.typical - parameter.vanishes)
    sides = (0, 1) if parameter.lower == parameter.vanishes else (-1, 1)
    for side in sides:
        model = score.effect.apply(fit.model, [parameter.vanishes + side * step])
        ends.append(heavy.train.residual(heavy.train.predict(model, fit.prediction)))
    exact = -(ends[1] - ends[0]) / ((sides[1] - sides[0]) * step)
    assert score.slope.shape == fit.residual.shape
    assert not score.slope[len(exact) :].any()
    # Newton's 1e-9 and the curvature of one-sided differences over the step, in which no contact begins to slip.
    np.testing.assert_allclose(score.slope[: len(exact)], exact, rtol=0, atol=2e-3 * np.abs(exact).max())


def test_what_is_left_is_confirmed_by_a_fit(
    heavy: Arrangement, refits: dict[str, Refit], left: dict[str, ResidualExplanation], listed: Catalogue
) -> None:
    accepting, right = add_effect(heavy, refits[WRONG]), listed.effect(RIGHT)
    result = explain_residual(accepting, [right], threshold=1.0)
    (score,) = screen(accepting, [right])
    # The same fit again.
    assert result.gain == pytest.approx(accepting.fit.chi2 - fit_quickly(accepting, score).chi2, rel=1e-9)
    # By a mass as weak as this one the derivative promises what the fit keeps, but for the curvature of the resonance.
    assert result.gain == pytest.approx(explain_residual(accepting, [right], np.inf).gain, rel=0.1)
    assert result.gain != explain_residual(accepting, [right], np.inf).gain


def checked(monkeypatch: pytest.MonkeyPatch, promised: list[float], kept: list[float], threshold: float) -> Any:
    """What is found where effects gain by a fit what is given, and which were fitted."""
    chi2, asked = 500.0, []

    def fit(arrangement: object, score: int) -> Any:
        asked.append(score)
        return SimpleNamespace(chi2=chi2 - kept[score])

    monkeypatch.setattr(residual_explanation, "compute_gains_by_covariance", lambda *_: np.array([promised]))
    monkeypatch.setattr(residual_explanation, "screen", lambda _, effects: [item.number for item in effects])
    monkeypatch.setattr(residual_explanation, "fit_quickly", fit)
    monkeypatch.setattr(residual_explanation, "find_unknown_forces", lambda _: [])
    effects: list[Any] = [SimpleNamespace(name=f"p {number}", number=number) for number in range(len(promised))]
    arrangement: Any = SimpleNamespace(
        fit=SimpleNamespace(chi2=chi2), cost=chi2, cost_with_error_left=lambda fit: fit.chi2,
        tested=lambda effect, fit: Refit(
            effect=effect, fit=fit, held_out_reduced_chi2=1.0, error=0.1, held_out_error=0.1
        ),
    )  # fmt: skip
    return explain_residual(arrangement, effects, threshold), asked


@pytest.mark.parametrize(
    ("promised", "kept", "threshold", "asked", "name", "gain"),
    [
        # The best promises what no fit keeps; the next one keeps more than it promised.
        ([40, 5, 70], [45, 0, 3], 20, [2, 0], "p 0", 45),
        # What would not matter is believed.
        ([40, 5, 70], [45, 0, 3], 50, [2], "p 0", 40),
        ([40, 5, 70], [45, 0, 3], 100, [], "p 2", 70),
        ([40, 5, 70], [45, 0, 3], np.inf, [], "p 2", 70),
        # Neither of both keeps anything, even if a fit ends above.
        ([40, 5, 70], [-1, 0, 3], 20, [2, 0], "p 1", 5),
        # Four are checked at most; of the others no more than the threshold is believed.
        ([40, 60, 70, 50, 90, 80], [41, 0, 71, 0, 0, 0], 20, [4, 5, 2, 1], "p 2", 71),
        ([40, 60, 70, 50, 90, 80], [99, 0, 0, 99, 0, 0], 20, [4, 5, 2, 1], "p 0", 20),
    ],
)
def test_promises_that_matter_are_checked(
    monkeypatch: pytest.MonkeyPatch,
    promised: list[float], kept: list[float], threshold: float, asked: list[int], name: str, gain: float,
) -> None:  # fmt: skip
    result, fits = checked(monkeypatch, promised, kept, threshold)
    assert MAX_FURTHER_FITS == 4
    assert fits == asked
    if result.refit is not None:
        others = {number: kept[number] for number in asked if f"p {number}" != name}
        assert {item.name: item.gain for item in result.others} == {f"p {key}": gain for key, gain in others.items()}
    else:
        assert not result.others
    assert (result.effect_name, result.gain) == (name, gain)
