"""One repeat: the noise that is stated, or that the curves show, takes the place of the scatter of repeats."""

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.errors import CampaignError
from correlation.feature.observation import take_training_part
from correlation.feature.table import extract_features
from correlation.feature.vector import FeatureVector
from correlation.noise.scatter import USUAL_JITTER, estimate_scatter

NOISE = 2e-3
#: One mode at 20 Hz with 2 % damping under 3 N.
GRID = np.linspace(17.0, 23.0, 61)


def response(frequency: np.ndarray) -> np.ndarray:
    w, natural = 2 * np.pi * frequency, 2 * np.pi * 20.0
    return np.asarray(3.0 / (natural**2 - w**2 + 0.04j * natural * w))


def campaign(grid: np.ndarray = GRID, n_repeat: int = 1, **sensor: object) -> Campaign:
    random, k = np.random.default_rng(5), len(grid) * n_repeat
    exact = np.tile(response(grid), n_repeat)
    value = exact * (1 + NOISE * (random.standard_normal(k) + 1j * random.standard_normal(k)))
    one = MeasuredSensor(name="tip", quantity="displacement", direction="z", **sensor)  # type: ignore[arg-type]
    return Campaign(
        title="one", folder=Path("one"), sensors=(one,), tests=(Test(name="jointed"),), held_out=HeldOut(),
        measurement=Measurement(
            test=np.zeros(k, dtype=int), order=np.arange(k), repeat=np.repeat(np.arange(n_repeat), len(grid)),
            sweep=np.ones(k, dtype=int), level=np.full(k, 3.0), frequency=np.tile(grid, n_repeat),
            sensor=np.zeros(k, dtype=int), harmonic=np.ones(k, dtype=int),
            value=value if one.has_phase else np.abs(value),
        ),
    )  # fmt: skip


def relative_noise(of: Campaign) -> np.ndarray:
    """Estimated noise of each number of one repeat, relative to its feature."""
    seen = take_training_part(of)
    features = FeatureVector.choose(seen.points, seen.value, seen.motion, seen.phased)
    nothing = np.zeros((len(features.row), 0))
    scatter = estimate_scatter(seen, features, [nothing, nothing], nothing, nothing)
    size = np.abs(3.0 / seen.value)[features.row]
    return np.asarray(scatter.noise / size)


@pytest.mark.parametrize("has_phase", [True, False])
def test_the_curve_of_one_repeat_shows_its_noise(has_phase: bool) -> None:
    result = relative_noise(campaign(has_phase=has_phase))
    assert len(result) == (2 if has_phase else 1) * len(GRID)
    # Some 30 or 60 independent numbers tell a standard deviation to 13 or 9 %; three of them are allowed.
    assert np.median(result) == pytest.approx(NOISE, rel=0.4)


@pytest.mark.parametrize("n_repeat", [1, 4])
def test_stated_noise_is_taken(n_repeat: int) -> None:
    result = relative_noise(campaign(n_repeat=n_repeat, noise=(0.01, 0.0)))
    np.testing.assert_allclose(result, 0.01, rtol=1e-12 if n_repeat == 1 else 0.01)


def test_a_short_curve_without_repeats_is_refused() -> None:
    with pytest.raises(CampaignError, match=r'"tip".*single repeat.*state the noise'):
        relative_noise(campaign(GRID[::12]))
    assert len(relative_noise(campaign(GRID[::12], noise=(0.0, 1e-5)))) == 2 * len(GRID[::12])


def test_features_of_one_repeat_have_its_noise() -> None:
    table = extract_features(campaign())
    assert np.median(table.deviation / np.abs(table.value)) == pytest.approx(NOISE, rel=0.4)
    stated = extract_features(campaign(noise=(0.01, 0.0)))
    np.testing.assert_allclose(stated.deviation, 0.01 * np.abs(stated.value), rtol=1e-12)


def test_repeats_tell_their_noise_where_none_is_stated() -> None:
    seen = take_training_part(campaign(n_repeat=2))
    assert np.isnan(seen.noise).all()
    assert np.isfinite(take_training_part(replace(campaign(n_repeat=2, noise=(0.1, 0.0)))).noise).all()


def test_the_preload_of_one_repeat_is_off_by_a_usual_amount() -> None:
    """Repeats would tell how far it is off: without them no change of 1 % is more than a standard deviation."""
    seen = take_training_part(campaign(noise=(1e-4, 0.0)))
    features = FeatureVector.choose(seen.points, seen.value, seen.motion, seen.phased)
    size, nothing = np.abs(3.0 / seen.value)[features.row], np.zeros((len(features.row), 0))
    by_preload = size[:, None]
    scatter = estimate_scatter(seen, features, [*[nothing] * 4, by_preload], nothing, nothing)
    one_percent = 0.01 * by_preload[:, 0]
    # Beside readings of 0.01 % the whole change is that of the preload: its prior alone is left.
    assert np.linalg.norm(scatter.whitening(one_percent)) == pytest.approx(1.0, rel=1e-2)
    assert scatter.jitter[-1] == pytest.approx(1e-4)


def test_a_test_without_repeats_beside_one_with_them_has_the_noise_of_its_curve() -> None:
    repeated, single = campaign(n_repeat=3, noise=(0.0, 0.0)), campaign()
    table, other = repeated.measurement, single.measurement
    columns = {item.name: getattr(other, item.name) for item in fields(Measurement)}
    columns |= {"test": other.test + 1, "value": 10 * other.value}
    both = {name: np.concatenate([getattr(table, name), column]) for name, column in columns.items()}
    tests = (Test(name="jointed"), Test(name="free", configuration="free"))
    mixed = replace(repeated, tests=tests, measurement=Measurement(**both))
    seen = take_training_part(mixed)
    features = FeatureVector.choose(seen.points, seen.value, seen.motion, seen.phased)
    of_free = features.points.free[features.row]
    shift = np.where(of_free, 1.0, 0.0)[:, None]
    nothing = np.zeros((len(features.row), 0))
    scatter = estimate_scatter(seen, features, [nothing, shift], nothing, nothing)
    size = np.abs(3.0 / seen.value)[features.row]
    # As above: the curve tells it to some ten percent, for the repeats there are twice as many numbers.
    assert np.median((scatter.noise / size)[of_free]) == pytest.approx(NOISE, rel=0.4)
    assert np.median((scatter.noise / size)[~of_free]) == pytest.approx(NOISE, rel=0.2)
    # What repeats of the free test would show is as large as usual.
    np.testing.assert_allclose(scatter.jitter[1], [[USUAL_JITTER[1] ** 2]])
