"""Signals at the door: clocks that a file has rounded."""

import numpy as np
import pytest

from correlation.errors import CampaignError
from correlation.signal.record import check_time, uniform_step


@pytest.mark.parametrize("written", ["{:.4f}", "{:.5g}", "{:.3e}"])
def test_a_uniform_clock_that_a_file_rounded_is_one(written: str) -> None:
    clock = 0.3 + np.arange(4000) / 5120
    rounded = np.array([float(written.format(instant)) for instant in clock])
    if (np.diff(rounded) <= 0).any():
        with pytest.raises(CampaignError, match="does not rise"):
            check_time(rounded, len(rounded))
        return
    # The line through many rounded instants is better than one of them.
    assert np.abs(check_time(rounded, len(rounded)) - clock).max() < 2e-5


def test_a_clock_that_jumps_is_left_as_it_is() -> None:
    clock = np.round(np.arange(1000) / 512, 4)
    clock[500:] += 0.01
    assert np.array_equal(check_time(clock, 1000), clock)
    with pytest.raises(CampaignError, match="steps of time"):
        uniform_step(clock)
