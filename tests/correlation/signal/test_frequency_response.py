"""Frequency responses of a filter whose transfer function is known exactly."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal

from correlation.errors import CampaignError
from correlation.signal.frequency_response import estimate_frequency_response

RATE = 1000.0
Array = NDArray[np.float64]
#: A discrete resonance at 120 Hz: poles within the unit circle, so that its response is exact at every frequency.
POLE = np.exp((-8.0 + 2j * np.pi * 120.0) / RATE)
NUMERATOR, DENOMINATOR = np.array([0.0, 1.0]), np.poly([POLE, POLE.conj()]).real


def exact(frequency: Array, decay: float = 0.0) -> NDArray[np.complex128]:
    z = np.exp((decay + 2j * np.pi * frequency) / RATE)
    value: NDArray[np.complex128] = (1 / z) / (1 + DENOMINATOR[1] / z + DENOMINATOR[2] / z**2)
    return value


def responses(force: Array) -> Array:
    filtered: Array = signal.lfilter(NUMERATOR, DENOMINATOR, force)
    return filtered


def test_random_excitation_gives_the_transfer_function_within_the_noise_of_the_blocks() -> None:
    random = np.random.default_rng(0)
    force = random.standard_normal(200_000)
    time = np.arange(len(force)) / RATE
    measured = responses(force) + 0.5 * random.standard_normal(len(force))
    result = estimate_frequency_response(time, force, measured, block=4.0)
    used = (result.frequency > 20) & (result.frequency < 300) & (np.abs(result.frequency - 120) > 8)
    # 99 blocks of Hann's window that overlap by half count as K / (1 + (K - 1) / (18 K)), about 94.
    variance = 0.5**2 / (99 / (1 + 98 / 99 / 18))
    score = np.abs(result.h1[0] - exact(result.frequency))[used] ** 2 / variance
    # Mean of an exponential score: 1; neighbours correlate under Hann's window, 1000 lines still give 5 %.
    assert np.mean(score) == pytest.approx(1, abs=0.25)


def test_noise_of_the_response_lowers_coherence_and_raises_h2_only() -> None:
    random = np.random.default_rng(1)
    force = random.standard_normal(100_000)
    clean = responses(force)
    noise = 3 * random.standard_normal(len(force))
    result = estimate_frequency_response(np.arange(len(force)) / RATE, force, clean + noise, block=1.0)
    line = np.argmin(np.abs(result.frequency - 200))
    size = np.abs(exact(result.frequency[line : line + 1]))[0]
    # Signal and noise have powers |H|^2 and 9 per line; 199 blocks give errors of a few per cent.
    assert result.coherence[0, line] == pytest.approx(size**2 / (size**2 + 9), abs=0.12)
    assert np.abs(result.h2[0, line]) == pytest.approx((size**2 + 9) / size, rel=0.5)


def blows(n: int, spacing: int, random: np.random.Generator) -> Array:
    force = np.zeros(n * spacing)
    for number in range(n):
        at = number * spacing + spacing // 4
        force[at : at + 6] = random.uniform(0.5, 1.5) * np.sin(np.pi * (np.arange(6) + 0.5) / 6)
    return force


def test_hammer_blows_under_an_exponential_window_are_exact_at_shifted_poles() -> None:
    random = np.random.default_rng(2)
    force = blows(6, 3000, random)
    time = np.arange(len(force)) / RATE
    decay = 6.0
    result = estimate_frequency_response(
        time, force, responses(force), block=1.0, excitation="hammer", decay=decay, force_window=True
    )
    assert result.decay == decay
    used = (result.frequency > 5) & (result.frequency < 200)
    # What is left at the end of a block is exp(-(8 + 6) * 1 s) = 8e-7, at the next blow exp(-8 * 3 s).
    np.testing.assert_allclose(result.h1[0][used], exact(result.frequency, decay)[used], rtol=1e-5)


def test_a_double_hit_is_left_out_and_reported() -> None:
    random = np.random.default_rng(3)
    force = blows(5, 1200, random)
    force[2 * 1200 + 300 + 60 : 2 * 1200 + 300 + 64] = 0.8
    result = estimate_frequency_response(
        np.arange(len(force)) / RATE, force, responses(force), block=0.8, excitation="hammer"
    )
    assert any("1 of 5 blows" in sentence and "second" in sentence for sentence in result.suspicions)


def test_bursts_are_exact() -> None:
    random = np.random.default_rng(4)
    force = np.zeros(8000)
    for number in range(4):
        force[2000 * number : 2000 * number + 500] = random.standard_normal(500)
    result = estimate_frequency_response(
        np.arange(len(force)) / RATE, force, responses(force), block=2.0, excitation="burst"
    )
    # The response has decayed to exp(-8 * 1.5 s) at the end of each block.
    np.testing.assert_allclose(result.h1[0][1:-1], exact(result.frequency)[1:-1], rtol=1e-3)


@pytest.mark.parametrize(
    ("changes", "word"),
    [({"block": 1e3}, "block"), ({"excitation": "kick"}, "kick"), ({"decay": -1.0}, "decay"),
     ({"excitation": "hammer", "block": 190.0}, "clean blow")],
)  # fmt: skip
def test_unusable_requests_are_refused(changes: dict[str, object], word: str) -> None:
    force = np.random.default_rng(5).standard_normal(2000)
    with pytest.raises(CampaignError, match=word):
        estimate_frequency_response(np.arange(2000) / RATE, force, force, **changes)  # type: ignore[arg-type]
