"""Where a model fails: errors that are put in at one place are found there, with their size and sign."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.feature.observation import Observation
from correlation.feature.vector import FeatureVector
from correlation.metric.misfit import (
    AXES,
    Misfit,
    compute_misfit,
    find_worst,
    find_worst_cell,
    split_into_bands,
    split_misfit,
    summarise_misfit,
)
from correlation.prediction import Points

FREQUENCY, DAMPING = 100.0, 0.01
GRID = FREQUENCY * np.linspace(0.95, 1.05, 24)
LEVELS, SENSORS, REPEATS = (1.0, 2.0), ("a", "b"), 4


def response(
    frequency: NDArray[np.float64], resonance: float = FREQUENCY, damping: float = DAMPING
) -> NDArray[np.complex128]:
    """One degree of freedom of 1 kg under 1 N [m]."""
    omega, natural = 2 * np.pi * frequency, 2 * np.pi * resonance
    return np.asarray(1 / (natural**2 - omega**2 + 2j * damping * natural * omega))


def observed(noise: float = 0.0) -> Observation:
    level, sensor, frequency = (item.ravel() for item in np.meshgrid(LEVELS, SENSORS, GRID, indexing="ij"))
    k = len(level)
    points = Points(
        free=np.zeros(k, dtype=bool), level=level.astype(float), frequency=frequency.astype(float), sensor=sensor,
        harmonic=np.ones(k, dtype=int),
    )  # fmt: skip
    random = np.random.default_rng(1)
    exact = points.level * response(points.frequency)
    shape = (k, REPEATS)
    scatter = noise * (random.standard_normal(shape) + 1j * random.standard_normal(shape))
    return Observation(
        points=points,
        repeat=exact[:, None] * (1 + scatter),
        motion=np.ones(k, dtype=bool),
        taken=np.ones(shape, dtype=bool),
    )


def compared(seen: Observation, predicted: NDArray[np.complex128], deviation: float = 0.01) -> Misfit:
    """Each number has a standard deviation of a share of its modulus, and nothing is common; so has a reading."""
    features = FeatureVector.choose(seen.points, seen.value, seen.motion)
    measured, model = features.of_values(seen.value), features.of_values(predicted)
    modulus = np.tile(np.abs(seen.points.level / seen.value), 2)
    standardised = np.nan_to_num((measured - model) / (deviation * modulus), nan=10.0)
    return compute_misfit(seen, features, predicted, standardised, standardised, deviation * modulus)


def test_an_error_is_found_where_it_is() -> None:
    seen = observed()
    wrong = (seen.points.sensor == "b") & (seen.points.level == 2) & (seen.points.frequency > 104)
    predicted = np.where(wrong, 1.2 * np.exp(0.1j), 1.0) * seen.value
    result = compared(seen, predicted)
    assert find_worst(split_misfit(result, "sensor")).label == "b"
    assert find_worst(split_misfit(result, "level")).label == "2 N"
    assert find_worst(split_misfit(result, "band")).label == "103.7 to 105 Hz jointed"
    cell, points = find_worst_cell(result)
    assert {*points.sensor} == {"b"}
    assert {*points.level} == {2.0}
    # Three of the band's four points are wrong: 1.2 and 0.1 rad are diluted by the fourth.
    assert cell.signed_amplitude_error == pytest.approx(np.sqrt((3 * 1.44 + 1) / 4) - 1)
    assert cell.signed_phase_error == pytest.approx(np.angle(3 * 1.2 * np.exp(0.1j) + 1))


@pytest.mark.parametrize("axis", AXES)
def test_the_shares_of_every_axis_add_up_to_the_whole(axis: str) -> None:
    seen = observed()
    result = compared(seen, seen.value * (1 + 0.01 * np.sin(np.arange(len(seen.points)))))
    split = split_misfit(result, axis)
    assert sum(share.n_number for share in split) == summarise_misfit(result).n_number == 2 * len(result)
    squares = sum(share.n_number * share.deviations**2 for share in split)
    assert squares == pytest.approx(summarise_misfit(result).n_number * summarise_misfit(result).deviations ** 2)


def test_bands_have_equally_many_frequencies() -> None:
    code, labels = split_into_bands(observed().points)
    assert len(labels) == 6
    assert (np.bincount(code) == 16).all()


def test_the_deviation_is_that_of_the_mean() -> None:
    noise = 0.02
    result = compared(observed(noise), observed().value)
    # 2 % in each part, in the mean of four repeats; the mean over 96 points has a scatter of 4 %, three of which allow.
    relative = result.deviation / np.abs(observed().value)
    assert np.sqrt(np.mean(relative**2)) == pytest.approx(noise / 2, rel=0.12)
    assert result.clear.all()


def test_one_repeat_has_the_noise_of_a_reading() -> None:
    seen = observed()
    single = replace(seen, repeat=seen.repeat[:, :1], taken=seen.taken[:, :1])
    result = compared(single, single.value, deviation=0.02)
    # Features are F / X, whose relative deviation is that of X.
    np.testing.assert_allclose(result.deviation, 0.02 * np.abs(single.value), rtol=1e-12)
    assert result.clear.all()
    assert not compared(single, single.value, deviation=0.3).clear.any()


def test_no_amplitude_is_told_where_nothing_was_predicted() -> None:
    seen = observed()
    with np.errstate(invalid="ignore"):
        result = compared(seen, np.full(len(seen.points), np.nan + 0j))
    assert not result.clear.any()
    assert np.isnan(summarise_misfit(result).amplitude_error)
