"""A decay with a wrong clock: named with the frequencies of both, and no model that is merely off."""

import numpy as np
import pytest

from correlation.data_quality.model import find_model_suspicions
from correlation.data_quality.response import find_response_suspicions
from correlation.data_quality.time_base import find_time_base_factor
from correlation.data_type.mode import compute_linear_modes
from correlation.data_type.ring_down import FreeDecay
from correlation.signal.ring_down import analyse_ring_down
from tests.correlation.data_quality.test_response_size import chain
from tests.correlation.data_quality.test_unit_suspicion import campaign


def decay(factor: float, frequency: float | None = None) -> FreeDecay:
    """The first mode of the chain, or another one, on a clock that makes all frequencies so many times as large."""
    own = float(compute_linear_modes(chain(), "jointed")[0][0]) if frequency is None else frequency
    time = np.arange(1500) / (25 * own)
    signal = np.exp(-0.02 * 2 * np.pi * own * time) * np.cos(2 * np.pi * own * time)
    time = time / factor
    modes = analyse_ring_down(time, signal, quantity="acceleration")
    return FreeDecay(
        name="blow", configuration="jointed", sensor="a", modes=modes, unit="m/s^2", time=time, signal=signal
    )


@pytest.mark.parametrize(
    ("factor", "words"), [(0.5, "twice what the times say"), (1e-3, "times in ms and read as s"), (1e3, "read as ms")]
)
def test_one_factor_on_the_clock_is_suspected_with_both_frequencies(factor: float, words: str) -> None:
    (result,) = find_response_suspicions(chain(), [decay(factor)])
    assert words in result.sentence
    own = float(compute_linear_modes(chain(), "jointed")[0][0])
    assert f"{own:.4g}" in result.sentence
    assert f"{factor * own:.4g}" in result.sentence
    assert not result.remark


def test_a_right_clock_is_not_suspected_and_a_mode_that_the_model_lacks_is_named() -> None:
    assert not find_response_suspicions(chain(), [decay(1.0)])
    (result,) = find_response_suspicions(chain(), [decay(1.0, 11.3)])
    assert result.remark
    assert "11.3 Hz" in result.sentence


def test_all_modes_must_have_the_factor() -> None:
    model = np.array([80.0, 250.0, 310.0])
    assert find_time_base_factor(2 * model[:2], model) == 2.0
    assert find_time_base_factor(np.array([160.0, 700.0]), model) is None
    assert find_time_base_factor(np.array([80.0, 500.0]), model) is None


@pytest.mark.parametrize(("factor", "unit"), [(1e3, '"kHz"'), (1e-3, '"Hz" instead of "kHz"')])
def test_a_column_of_steady_states_in_kilohertz_is_suspected(factor: float, unit: str) -> None:
    measured = campaign()
    frequency = measured.measurement.frequency
    result = find_model_suspicions(measured, [factor * float(np.median(frequency))])
    assert len(result) == len(measured.tests)
    assert all(unit in item.sentence for item in result)
    assert not find_model_suspicions(measured, [float(np.median(frequency))])
