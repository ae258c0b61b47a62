"""Screening and refits: what is planted comes first, as strong as it is; what is not planted gains what chance does."""

from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType

import numpy as np
import pytest

from correlation.model import Model
from correlation.noise.nuisance import Budget
from diagnosis.candidate.catalogue import Catalogue
from diagnosis.candidate.effect import Effect, EffectParameter
from diagnosis.decision.verdict import compute_detectable_strengths
from diagnosis.fit.arrangement import Arrangement, arrange
from diagnosis.fit.calibration_parameter import list_calibration_parameters
from diagnosis.fit.refit import MAX_BY_SLIP, make_baseline_refit, refit, shortlist
from diagnosis.screening import Score, make_calibration_basis, screen
from diagnosis.threshold.detection_threshold import draw_null_gains, find_threshold

#: What `heavy` hides [kg], of 0.8.
MASS, WHERE = 5e-3, "mass at tip z"


@pytest.fixture(scope="module")
def scores(heavy: Arrangement, listed: Catalogue) -> list[Score]:
    return screen(heavy, listed.candidates)


@pytest.fixture(scope="module")
def complete(small: Model, paper: ModuleType) -> Arrangement:
    campaign = paper.make_campaign(small, jitter=3e-5, seed=6)
    return arrange(
        campaign,
        small,
        list_calibration_parameters(small, deviation={"kn": 0.0, "E": 0.0}),
        Budget(frequency=0.0, compliance=0.0),
    )


def test_a_planted_mass_comes_first_with_its_strength(scores: list[Score]) -> None:
    best = scores[0]
    assert best.effect.name == WHERE
    # `detectable` is the strength that moves the measurements by one standard deviation: its own standard deviation.
    # The screening is linear: the curvature over 0.3 % of the frequency is 2 %.
    assert best.strength == pytest.approx(MASS, abs=3 * best.detectable + 0.03 * MASS)
    assert best.gain == pytest.approx((best.strength / best.detectable) ** 2, rel=1e-6)
    assert [score.gain for score in scores] == sorted((score.gain for score in scores), reverse=True)


def test_directions_are_units_across_the_accepted_parameters(scores: list[Score], heavy: Arrangement) -> None:
    basis = make_calibration_basis(heavy)
    np.testing.assert_allclose(basis.T @ basis, np.eye(3), atol=1e-12)
    for score in scores:
        assert 0 <= score.absorbed <= 1
        if score.size:
            assert np.linalg.norm(score.direction) == pytest.approx(1)
            np.testing.assert_allclose(basis.T @ score.direction, 0, atol=1e-10)
        else:
            assert score.gain == 0
            assert score.detectable == np.inf


@dataclass(frozen=True, kw_only=True, eq=False)
class BeyondThreshold:
    """An effect on joints that begins at a negative strength alone, as a gap that closes: no derivative at zero."""

    inner: Effect
    threshold: float
    sign: float = 1.0

    name: str = "beyond a threshold"
    kind: str = "threshold"
    physics: str = ""
    signature: str = ""

    @property
    def parameters(self) -> tuple[EffectParameter, ...]:
        most = 4 * self.threshold
        return (EffectParameter(name="mass", unit="kg", lower=-most, upper=most, typical=0.1 * self.threshold),)

    def apply(self, model: Model, values: Sequence[float]) -> Model:
        changed = self.inner.apply(model, [self.sign * max(-values[0] - self.threshold, 0.0)])
        joint = changed.system.joints[0]
        return changed.with_joints({joint.name: {"preload": joint.preload}})


def test_an_effect_that_begins_beyond_a_threshold_is_tried_beyond_it(scores: list[Score], heavy: Arrangement) -> None:
    """A mass of 5 g begins at -5 g, so that it takes -10 g, the strength halfway to the bound."""
    (score,) = screen(heavy, [BeyondThreshold(inner=scores[0].effect, threshold=MASS)])
    # The difference quotient is that of the derivative of the mass, but for a curvature of 2 %.
    assert score.strength == pytest.approx(-2 * MASS, rel=0.1)
    assert score.gain == pytest.approx(scores[0].gain, rel=0.1)
    assert not score.slope.any()
    assert score.begins in (2 * MASS, 4 * MASS)


def test_an_effect_on_one_side_explains_no_residual_of_the_other_sign(scores: list[Score], heavy: Arrangement) -> None:
    """It removes mass where mass is missing: nothing is gained, but the data would show it beyond its threshold."""
    effect = BeyondThreshold(inner=scores[0].effect, threshold=MASS, sign=-1.0)
    (score,) = screen(heavy, [effect])
    assert (score.gain, score.strength) == (0.0, 0.0)
    assert score.size > 0
    assert compute_detectable_strengths([score], 25.0)[effect.name] >= 2 * MASS


def test_a_calibration_parameter_is_absorbed_by_itself(heavy: Arrangement) -> None:
    zeta = heavy.calibration[2]
    (score,) = screen(heavy, [zeta])
    # Its prior of 20 % is all that the data lack against the same number without one.
    assert score.absorbed > 0.99
    assert score.gain < 1


def test_the_refit_finds_the_mass_and_explains_the_held_out_repeat(scores: list[Score], heavy: Arrangement) -> None:
    chosen = shortlist(scores, heavy.selection)
    assert chosen[0] is scores[0]
    assert len(chosen) <= heavy.selection.n_shortlisted + MAX_BY_SLIP
    before, after = make_baseline_refit(heavy), refit(heavy, chosen[0])
    # Normal: 4 standard deviations.
    assert after.strength == pytest.approx(MASS, abs=4 * after.deviation)
    assert after.deviation < 0.2 * MASS
    assert (before.strength, before.deviation) == (0.0, 0.0)
    # What the screening promises is what chi^2 falls by, but for curvature.
    assert heavy.fit.chi2 - after.fit.chi2 == pytest.approx(scores[0].gain, rel=0.25)
    assert after.held_out_reduced_chi2 < before.held_out_reduced_chi2
    assert after.held_out_error < before.held_out_error
    # A single reading's noise of 1e-3 in each part, and its floor.
    assert after.held_out_error < 0.01


def test_when_nothing_is_missing_nothing_stands_out(complete: Arrangement, listed: Catalogue) -> None:
    result = screen(complete, listed.candidates)
    # Chance exceeds it once in a thousand campaigns; twice that for covariances known from four repeats alone.
    assert result[0].gain < 2 * find_threshold(draw_null_gains(result), 1e-3)
