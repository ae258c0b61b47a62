"""Lines of a frequency response at which the coherence is low do not carry its modes."""

import numpy as np
import pytest
from numpy.typing import NDArray

from correlation.campaign.measurement import MeasuredSensor
from correlation.data_type.measured_response import MeasuredResponse
from correlation.data_type.response_modes import read_modes
from correlation.signal.frequency_response import compute_coherence_limit, estimate_frequency_response

MODES, DAMPING = np.array([40.0, 55.0]), 0.01
FREQUENCY = np.arange(20.0, 200.0, 0.1)


def receptance(frequency: NDArray[np.float64]) -> NDArray[np.complex128]:
    omega, own = 2 * np.pi * frequency[:, None], 2 * np.pi * MODES
    return np.asarray((1 / (own**2 - omega**2 + 2j * DAMPING * own * omega)).sum(axis=1))


def measured(low: NDArray[np.bool_]) -> tuple[MeasuredResponse, list[MeasuredSensor]]:
    """A response whose force is next to nothing at the lines `low`: there it is noise of any size."""
    random = np.random.default_rng(3)
    noise = random.standard_normal(FREQUENCY.shape) + 1j * random.standard_normal(FREQUENCY.shape)
    h = receptance(FREQUENCY) * (1 + 0.01 * noise)
    value = np.where(low, 1e3 * np.abs(h).max() * noise, h)
    response = MeasuredResponse(
        name="hammer", test=-1, configuration="free", sensors=("tip",), frequency=FREQUENCY, value=value[None, :],
        units=("m per N",), coherence=np.where(low, 0.05, 0.99)[None, :], level=None, repeat=1,
    )  # fmt: skip
    sensor = MeasuredSensor(name="tip", quantity="displacement", place="tip", direction="z")
    return response, [sensor]


def test_modes_are_those_of_the_coherent_band() -> None:
    modes = read_modes(*measured(FREQUENCY > 70)).modes
    # 1 % of noise at some ten lines within the half-power width of each.
    np.testing.assert_allclose([mode.frequency for mode in modes], MODES, rtol=1e-3)
    np.testing.assert_allclose([mode.damping for mode in modes], DAMPING, rtol=0.1)


def test_one_sentence_says_that_no_band_is_left() -> None:
    response = read_modes(*measured(FREQUENCY > 0))
    assert not response.modes
    assert sum("coherence" in sentence for sentence in response.suspicions) == 1


def test_a_coherent_response_loses_no_line() -> None:
    response, _ = measured(FREQUENCY < 0)
    assert response.coherent_lines.all()


@pytest.mark.parametrize("averages", [12, 40])
def test_noise_passes_the_limit_of_the_coherence_as_rarely_as_it_says(averages: int) -> None:
    random = np.random.default_rng(4)
    force, response = random.standard_normal((2, averages * 2000))
    result = estimate_frequency_response(
        np.arange(len(force)) / 1000, force, response, block=2.0, excitation="burst"
    ).coherence  # fmt: skip
    assert not (result > compute_coherence_limit(averages, result.size)).any()
    # The same formula at one chance in twenty, where the limits on it do not act.
    expected = 1 - 0.05 ** (1 / (averages - 1))
    # 1000 lines: 50 +- 7.
    assert abs(int((result > expected).sum()) - 50) < 21
