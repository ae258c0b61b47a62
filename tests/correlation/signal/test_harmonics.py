"""Harmonics of a time history: exact without noise, with honest deviations in noise; what spoils them is noticed."""

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.signal.harmonics import Harmonics, fit_harmonics
from correlation.signal.steady_state import fit_steady_state

RATE, FREQUENCY = 5000.0, 37.3
COEFFICIENTS = np.array([0.3, np.exp(0.4j), 0.02j, 0.1 * np.exp(1j)])
Array = NDArray[np.float64]


def steady(time: Array, frequency: float = FREQUENCY, coefficients: NDArray[np.complex128] = COEFFICIENTS) -> Array:
    order = np.arange(len(coefficients))
    waves: Array = (coefficients * np.exp(2j * np.pi * frequency * np.outer(time, order))).real.sum(axis=1)
    return waves


def times(duration: float, start: float = 0.0) -> Array:
    return start + np.arange(round(duration * RATE)) / RATE


@pytest.mark.parametrize("duration", [10 / FREQUENCY, 10.5 / FREQUENCY, 1.0, 0.05])
@pytest.mark.parametrize("start", [0.0, 123.4])
def test_whole_and_broken_numbers_of_periods_are_exact(duration: float, start: float) -> None:
    time = times(duration, start)
    result = fit_harmonics(time, steady(time), FREQUENCY, 3)
    # Round-off of the phase at t = 123 s is 123 * 37.3 * 2 pi * 1e-16 * 3; the fit of 1.9 periods amplifies little.
    np.testing.assert_allclose(result.coefficients[0], COEFFICIENTS, atol=1e-10)
    assert result.settled
    assert not result.suspicions


def test_an_uneven_clock_is_exact() -> None:
    random = np.random.default_rng(1)
    time = np.sort(random.uniform(0, 1, 3000))
    np.testing.assert_allclose(
        fit_harmonics(time, steady(time), FREQUENCY, 3).coefficients[0], COEFFICIENTS, atol=1e-10
    )


@pytest.mark.parametrize("frequency", [FREQUENCY, 11.123, 400.0])
def test_the_frequency_of_a_clean_record_is_found_exactly(frequency: float) -> None:
    time = times(1.0)
    # Gauss-Newton squares the error of the first guess, a quarter of a line, until round-off.
    assert fit_harmonics(time, steady(time, frequency), None, 3).frequency == pytest.approx(frequency, rel=1e-9)


def test_a_weak_fundamental_below_a_strong_harmonic_is_found() -> None:
    time = times(1.0)
    values = steady(time, 20.0, np.array([0, 0.1, 0, 1.0]))
    assert fit_harmonics(time, values, None, 3).frequency == pytest.approx(20.0, rel=1e-9)


def test_errors_in_white_noise_are_as_large_as_their_deviations() -> None:
    time = times(1.0)
    random = np.random.default_rng(2)
    scores = []
    for _ in range(75):
        result = fit_harmonics(time, steady(time) + 0.05 * random.standard_normal(len(time)), None, 3)
        error = (result.coefficients[0] - COEFFICIENTS) / result.deviation[0]
        scores.append([*np.abs(error[1:]) / np.sqrt(2), (result.frequency - FREQUENCY) / result.frequency_deviation])
    # Variance of 75 normal scores: 1 +- 0.16; 2.7 of it.
    variance = np.mean(np.square(scores), axis=0)
    assert (variance > 0.56).all()
    assert (variance < 1.44).all()


def test_deviations_know_coloured_noise() -> None:
    time = times(2.0)
    random = np.random.default_rng(3)
    scores = []
    for _ in range(100):
        noise = np.convolve(random.standard_normal(len(time) + 99), np.ones(100) / 10, mode="valid")  # low frequencies
        result = fit_harmonics(time, steady(time) + 0.05 * noise, FREQUENCY, 3)
        scores.append(np.abs((result.coefficients[0] - COEFFICIENTS) / result.deviation[0]) ** 2 / 2)
    # White deviations would be wrong by factors between 0.3 (first) and 10 (third harmonic) in variance; the means of
    # 100 exponential scores are 1 +- 0.1, and the power is averaged over a band in which it changes by a third.
    mean = np.mean(scores, axis=0)[1:]
    assert (mean > 0.6).all()
    assert (mean < 1.6).all()


def test_a_drifting_amplitude_is_not_settled_and_says_by_how_much() -> None:
    time = times(1.0)
    result = fit_harmonics(time, (1 + 0.1 * time) * np.cos(2 * np.pi * FREQUENCY * time), FREQUENCY, 3)
    assert not result.settled
    middle = time[-1] / 2
    assert result.drift[0] == pytest.approx(0.1 * middle / (1 + 0.1 * middle), rel=1e-9)  # the model is exact
    assert any("settled" in sentence for sentence in result.suspicions)


def test_a_foreign_tone_is_reported_with_its_frequency_and_does_not_bias() -> None:
    time = times(2.0)
    random = np.random.default_rng(4)
    values = steady(time) + 0.1 * np.cos(2 * np.pi * 50 * time) + 0.01 * random.standard_normal(len(time))
    result = fit_harmonics(time, values, FREQUENCY, 3)
    assert any("50 Hz" in sentence for sentence in result.suspicions)
    # The tone leaks by about 1 / (pi * 2 s * 12.7 Hz) of its amplitude.
    np.testing.assert_allclose(result.coefficients[0], COEFFICIENTS, atol=0.003)


@pytest.mark.parametrize("order", [4, 7, 9])
@pytest.mark.parametrize("cycles", [0.0, 0.4])
def test_a_harmonic_beyond_those_that_are_fitted_is_not_foreign(order: int, cycles: float) -> None:
    time = times(2.0)
    # A line that is not in step with the record leaks; one 3 lines beside the harmonic is foreign again.
    for beside, foreign in ((cycles / time[-1], False), ((cycles + 3) / time[-1], True)):
        values = steady(time) + 0.1 * np.cos(2 * np.pi * (order * FREQUENCY + beside) * time)
        suspicions = fit_harmonics(time, values, FREQUENCY, 3).suspicions
        assert any("tone" in sentence for sentence in suspicions) == foreign


def test_a_half_frequency_is_called_a_subharmonic() -> None:
    time = times(2.0)
    values = steady(time) + 0.1 * np.cos(np.pi * FREQUENCY * time)
    assert any("subharmonic" in sentence for sentence in fit_harmonics(time, values, FREQUENCY, 3).suspicions)


def clipped(result: Harmonics) -> bool:
    return any("clipped" in sentence for sentence in result.suspicions)


@pytest.mark.parametrize("share", [0.7, 0.9, 0.98])
def test_a_clipped_signal_is_reported(share: float) -> None:
    time = times(1.0)
    random = np.random.default_rng(5)
    values = steady(time) + 0.01 * random.standard_normal(len(time))
    assert clipped(fit_harmonics(time, np.minimum(values, share * values.max()), FREQUENCY, 3))
    assert clipped(fit_harmonics(time, np.maximum(values, share * values.min()), FREQUENCY, 3))


@pytest.mark.parametrize("n_step", [8, 30, 256, 65536])
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_coarse_converter_is_not_clipped(n_step: int, noise: float) -> None:
    time = times(1.0)
    random = np.random.default_rng(6)
    values = steady(time) + noise * random.standard_normal(len(time))
    step = np.ptp(values) / n_step
    assert not clipped(fit_harmonics(time, np.round(values / step) * step, FREQUENCY, 3))


def test_a_sine_sampled_in_step_with_its_period_is_not_clipped() -> None:
    time = np.arange(4096) / 2048
    values = np.sin(2 * np.pi * 80 * time)  # its period of 128 samples holds one at each crest
    assert np.count_nonzero(values == values.max()) >= 32
    assert not clipped(fit_harmonics(time, values, 80.0, 3))


@pytest.mark.parametrize("decay_time", [0.02, 0.05, 0.1])
@pytest.mark.parametrize("frequency", [FREQUENCY, 40.0, 200.0])
def test_the_settled_part_of_a_record_is_used(decay_time: float, frequency: float) -> None:
    time = times(1.6)
    random = np.random.default_rng(7)
    force = 3 * np.cos(2 * np.pi * FREQUENCY * time + 1) + 0.01 * random.standard_normal(len(time))
    start = 0.3 * np.exp(-time / decay_time) * np.cos(2 * np.pi * frequency * time)
    values = steady(time) + start + 0.01 * random.standard_normal(len(time))
    result = fit_steady_state(time, values, force, 3)
    assert result.settled
    assert 0 < result.start < 0.8
    assert result.reference is not None
    assert result.reference[1] == pytest.approx(3, rel=1e-3)
    # 1 % is the tolerance of what may still decay.
    np.testing.assert_allclose(result.coefficients[0], COEFFICIENTS * np.exp(-1j * np.arange(4)), atol=0.005)


def test_a_record_that_never_settles_says_so() -> None:
    time = times(1.6)
    force = np.cos(2 * np.pi * FREQUENCY * time)
    result = fit_steady_state(time, (1 + 0.3 * np.exp(-time)) * force, force, 3)
    assert not result.settled
    assert any("settled" in sentence for sentence in result.suspicions)


def test_steady_records_in_noise_are_called_settled() -> None:
    time = times(1.0)
    random = np.random.default_rng(8)
    force = np.cos(2 * np.pi * FREQUENCY * time)
    results = [
        fit_steady_state(time, steady(time) + 0.1 * random.standard_normal(len(time)), force, 3) for _ in range(60)
    ]
    # Each of several tests is wrong in 1 of 1000 records.
    assert sum(result.settled and result.start == 0 for result in results) >= 58


@pytest.mark.parametrize(
    ("time", "values", "frequency", "word"),
    [
        (times(1.0), np.full(5000, np.nan), FREQUENCY, "channel 0"),
        (times(1.0), np.ones(5000), None, "constant"),
        (times(1.0), np.random.default_rng(9).standard_normal(5000), None, "dominant"),
        (times(1.0), steady(times(1.0)), 900.0, "harmonic 3"),
        (times(1.0), steady(times(1.0)), 1.0, "periods"),
        (times(1.0), steady(times(1.0)), -3.0, "-3"),
        (times(1.0), steady(times(1.0)), 0.0, "positive"),
        (times(1.0)[::-1], steady(times(1.0)), FREQUENCY, "rise"),
        (times(0.5), steady(times(1.0)), FREQUENCY, "2500"),
    ],
)
def test_unusable_records_are_refused(time: Array, values: Array, frequency: float | None, word: str) -> None:
    with pytest.raises(CampaignError, match=word):
        fit_harmonics(time, values, frequency, 3)


def test_a_reference_of_zeros_is_refused() -> None:
    with pytest.raises(CampaignError, match="reference"):
        fit_steady_state(times(1.0), steady(times(1.0)), np.zeros(5000), 3)
