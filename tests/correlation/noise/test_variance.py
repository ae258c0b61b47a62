"""What the pooled noise of few repeats must satisfy, on data whose noise is known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.measurement import Campaign, HeldOut, MeasuredSensor, Measurement, Test
from correlation.errors import CampaignError
from correlation.feature.table import FeatureTable, extract_features, split
from correlation.noise.variance import fit_variance_law

LEVELS = (1.0, 3.0, 5.0, 10.0)
FREQUENCY = np.linspace(90.0, 106.0, 24)
HARMONICS = (0, 1, 3)
TWO_SIDED_95 = 1.96


def exact(sensor: int, harmonic: int, level: float, frequency: float) -> complex:
    """A resonance at 98 Hz with a damping of 0.5 %."""
    response = level * 1e-6 * (1 + sensor) / (1 - (frequency / 98) ** 2 + 0.01j) / max(harmonic, 1) ** 2
    return response if harmonic else complex(abs(response))


def campaign(
    seed: int,
    *,
    repeats: int = 5,
    together: float = 0.0,
    heavy_tailed: bool = False,
    proportional: float = 0.01,
    constant: float = 2e-7,
    sweep_offset: float = 0.0,
    n_sensor: int = 4,
) -> Campaign:
    """Noise a |X| and b in each part; a share of its variance common to both sweeps of a repeat; heavy tails: t."""
    rng = np.random.default_rng(seed)
    rows = []
    for sensor in range(n_sensor):
        for harmonic in HARMONICS:
            for level in LEVELS:
                for frequency in FREQUENCY:
                    x = exact(sensor, harmonic, level, frequency)
                    deviation = np.hypot(proportional * abs(x), constant)
                    # A variance of the point's own, whose mean is 1: what an inverse chi-squared of 6 degrees does.
                    deviation *= np.sqrt(4 / rng.chisquare(6)) if heavy_tailed else 1.0
                    for repeat in range(1, repeats + 1):
                        common = rng.normal(size=2)
                        for sweep in (1, -1):
                            noise = np.sqrt(together) * common + np.sqrt(1 - together) * rng.normal(size=2)
                            value = x + deviation * (noise[0] + (1j * noise[1] if harmonic else 0))
                            value += sweep_offset * sweep
                            rows.append((0, repeat, repeat, sweep, level, frequency, sensor, harmonic, value))
    names = ("test", "order", "repeat", "sweep", "level", "frequency", "sensor", "harmonic", "value")
    columns = dict(zip(names, zip(*rows, strict=True), strict=True))
    return Campaign(
        title="",
        folder=Path(),
        sensors=tuple(
            MeasuredSensor(name=f"s{number}", quantity="displacement", direction="z", place="tip")
            for number in range(n_sensor)
        ),
        tests=(Test(name="stepped"),),
        measurement=Measurement(**columns),
        held_out=HeldOut(levels=(5.0,), repeats=(4, 5)),
    )


def truth(table: FeatureTable) -> np.ndarray:
    keys = zip(table.sensor, table.harmonic, table.level, table.frequency, strict=True)
    return np.array([exact(*key) for key in keys])


def whitened(table: FeatureTable) -> np.ndarray:
    error = (table.value - truth(table)) / table.deviation
    return np.concatenate([error.real, error.imag[table.harmonic > 0]])


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(
    "noise",
    [
        {},
        {"together": 0.5},
        {"together": 1.0},
        {"heavy_tailed": True},
        {"proportional": 0.0},
        {"constant": 0.0},
    ],
    ids=["plain", "sweeps half alike", "sweeps alike", "heavy-tailed", "constant only", "proportional only"],
)
def test_nineteen_in_twenty_means_are_within_two_deviations(noise: dict[str, float], seed: int) -> None:
    made = campaign(seed, **noise)  # type: ignore[arg-type]
    for table in (extract_features(made), *split(made)):
        within = np.abs(whitened(table)) < TWO_SIDED_95
        # 95 %, give or take 3 standard deviations of a share of some 1400 values or more (0.6 % each), and a few per
        # mille because deviations from 4 to 10 values are themselves uncertain.
        assert 0.93 < within.mean() < 0.97


def test_the_law_of_the_variance_is_found() -> None:
    rng = np.random.default_rng(4)
    amplitude, dof = rng.uniform(0.1, 2.0, 4000), np.full(4000, 8.0)
    scatter = (0.03**2 * amplitude**2 + 0.02**2) * rng.chisquare(8, 4000) / 8
    a2, b2 = fit_variance_law(amplitude**2, scatter, dof)
    # A variance from 4000 * 8 degrees of freedom is good to 0.8 %; two terms that share them, to a few times that.
    assert a2 == pytest.approx(0.03**2, rel=0.05)
    assert b2 == pytest.approx(0.02**2, rel=0.05)


def test_a_few_outlying_points_do_not_move_the_law() -> None:
    rng = np.random.default_rng(5)
    amplitude, dof = rng.uniform(0.1, 2.0, 1000), np.full(1000, 8.0)
    scatter = (0.03**2 * amplitude**2 + 0.02**2) * rng.chisquare(8, 1000) / 8
    scatter[::33] *= 100.0
    a2, b2 = fit_variance_law(amplitude**2, scatter, dof)
    # Three per cent of points, a hundred times too scattered, quadruple a mean; cut at the 95 % quantile they add 6 %.
    assert a2 + b2 == pytest.approx(0.03**2 + 0.02**2, rel=0.15)


def test_an_outlying_point_keeps_its_own_deviation() -> None:
    made = campaign(6, n_sensor=1)
    table = made.measurement
    outlying = (table.level == 10.0) & (table.frequency == FREQUENCY[12]) & (table.harmonic == 1)
    value = table.value.copy()
    value[outlying] += 5e-5 * np.random.default_rng(7).normal(size=outlying.sum())
    columns = {name: getattr(table, name) for name in ("test", "order", "repeat", "sweep", "level", "frequency")}
    noisy = Measurement(**columns, sensor=table.sensor, harmonic=table.harmonic, value=value)
    before, after = (
        extract_features(
            Campaign(title="", folder=Path(), sensors=made.sensors, tests=made.tests, measurement=m, held_out=HeldOut())
        )
        for m in (table, noisy)
    )
    at = (before.level == 10.0) & (before.frequency == FREQUENCY[12]) & (before.harmonic == 1)
    others = (before.harmonic == 1) & ~at
    assert after.deviation[at] > 2 * before.deviation[at]
    # The other 95 points of the channel hardly notice one in 96; the fit of few points moves by some per cent.
    ratio = after.deviation[others] / before.deviation[others]
    assert np.abs(ratio - 1).max() < 0.3
    assert np.median(np.abs(ratio - 1)) < 0.1


def test_sweeps_that_disagree_are_told_by_their_spread() -> None:
    agree, disagree = extract_features(campaign(8)), extract_features(campaign(8, sweep_offset=2e-6))
    # Rayleigh's distribution: 95 % below sqrt(-2 ln 0.05) = 2.448 for complex values; of real ones, more.
    assert 0.93 < (agree.spread[agree.harmonic > 0] < 2.448).mean() < 0.97
    np.testing.assert_allclose(agree.deviation, disagree.deviation, rtol=1e-3)  # no noise; amplitudes differ by 1e-6
    quiet = np.abs(disagree.value) < 1e-5
    assert (disagree.spread[quiet] > 10).all()


def test_no_value_of_training_is_held_out() -> None:
    made = campaign(9, n_sensor=1)
    train, held = split(made)
    assert 5.0 not in train.level
    assert set(train.n) == {6}  # three repeats, two sweeps
    assert set(held.n[held.level == 5.0]) == {10}
    assert set(held.n[held.level != 5.0]) == {4}
    assert train.n.sum() + held.n.sum() == len(made.measurement)
    # What is held out cannot be felt in training: blow it up.
    table = made.measurement
    value = np.where(made.held_out.rows(table), 1e3 * table.value, table.value)
    names = ("test", "order", "repeat", "sweep", "level", "frequency", "sensor", "harmonic")
    blown = Measurement(**{name: getattr(table, name) for name in names}, value=value)
    again, _ = split(
        Campaign(
            title="", folder=Path(), sensors=made.sensors, tests=made.tests, measurement=blown, held_out=made.held_out
        )
    )
    np.testing.assert_array_equal(again.value, train.value)
    np.testing.assert_array_equal(again.deviation, train.deviation)


def test_features_are_means_at_each_point() -> None:
    made = campaign(10, n_sensor=1)
    table, measured = extract_features(made, levels=[3.0], repeats=[1, 2]), made.measurement
    assert set(table.level) == {3.0}
    for row in (0, len(table) // 2, len(table) - 1):
        at = (measured.level == 3.0) & (measured.repeat <= 2) & (measured.frequency == table.frequency[row])
        at &= measured.harmonic == table.harmonic[row]
        assert table.value[row] == pytest.approx(measured.value[at].mean(), rel=1e-12)  # round-off
        assert table.n[row] == 4


def test_frequencies_that_are_rounded_differently_are_one() -> None:
    made = campaign(11, n_sensor=1)
    table = made.measurement
    names = ("test", "order", "repeat", "sweep", "level", "sensor", "harmonic", "value")
    rounded = np.where(table.sweep == 1, table.frequency, np.round(table.frequency, 4))
    other = Measurement(**{name: getattr(table, name) for name in names}, frequency=rounded)
    again = extract_features(
        Campaign(title="", folder=Path(), sensors=made.sensors, tests=made.tests, measurement=other, held_out=HeldOut())
    )
    assert set(again.n) == {10}


def test_without_noise_deviations_stay_positive() -> None:
    table = extract_features(campaign(12, proportional=0.0, constant=0.0, n_sensor=1))
    assert (table.deviation > 0).all()
    assert (table.deviation < 1e-8 * np.abs(table.value).max()).all()


def test_unknown_noise_is_refused() -> None:
    made = campaign(13, n_sensor=1)
    short = replace(made, measurement=made.measurement.where(made.measurement.frequency < FREQUENCY[6]))
    with pytest.raises(CampaignError, match='test "stepped", sensor "s0": no point was measured twice in one sweep'):
        extract_features(short, repeats=[1])


def test_an_empty_choice_is_refused() -> None:
    with pytest.raises(CampaignError, match="nothing was measured at these levels and repeats"):
        extract_features(campaign(14, n_sensor=1), levels=[4.0])


def test_nothing_held_out_is_refused() -> None:
    made = campaign(15, n_sensor=1)
    bare = Campaign(
        title="",
        folder=Path(),
        sensors=made.sensors,
        tests=made.tests,
        measurement=made.measurement,
        held_out=HeldOut(),
    )
    with pytest.raises(CampaignError, match=r"holds out nothing; add \[held_out\]"):
        split(bare)


def test_held_out_means_have_the_noise_of_the_whole_campaign() -> None:
    made = campaign(16, n_sensor=1)
    _, held = split(made)
    whole = extract_features(made)
    rows = {key: row for row, key in enumerate(zip(whole.harmonic, whole.level, whole.frequency, strict=True))}
    same = whole.where(np.array([rows[key] for key in zip(held.harmonic, held.level, held.frequency, strict=True)]))
    np.testing.assert_allclose(held.deviation**2 * held.n, same.deviation**2 * same.n, rtol=1e-12)  # round-off
