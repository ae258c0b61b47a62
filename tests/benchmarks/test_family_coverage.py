"""The benchmark of families in small: a system's own campaign lies within its limits, another system's leaves them."""

import numpy as np
import pytest

from benchmarks.family_coverage import LEVELS, measure, random_model, verdicts_of
from correlation.campaign.measurement import Campaign
from correlation.model import Model
from tests.slow import slow

#: Two masses on one contact, of the committed seeds of the benchmark.
SEED = 3


@pytest.fixture(scope="module")
def model() -> Model:
    made = random_model(SEED)
    assert made is not None
    return made


def campaign(model: Model, change: str) -> Campaign:
    return measure(model, np.random.default_rng([20261124, SEED]), change, 0.0)


@slow
def test_what_time_integration_measures_lies_within_the_limits_of_harmonic_balance(
    model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Contacts stick at the lowest level, and slip at the highest.
    monkeypatch.setattr("benchmarks.family_coverage.LEVELS", (LEVELS[0], LEVELS[-1]))
    verdicts = verdicts_of(model, campaign(model, "none"))
    # Fundamentals of the motion and of both forces, and their static parts, at each level.
    assert len(verdicts) == 5 * 2
    assert not any(item.leaves_band for item in verdicts)
    # One reading of noise in 370 lies outside.
    assert all(item.coverage > 0.95 for item in verdicts)


@slow
def test_a_softer_contact_leaves_the_limits(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    # At one level: it need not leave the limits of all.
    monkeypatch.setattr("benchmarks.family_coverage.LEVELS", LEVELS[:1])
    assert any(item.leaves_band for item in verdicts_of(model, campaign(model, "kt")))
