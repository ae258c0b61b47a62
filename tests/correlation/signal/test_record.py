"""Signals at the door: clocks that a file has rounded."""

from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.time_record import record_of_columns
from correlation.errors import CampaignError
from correlation.file.read_file import read_file
from correlation.signal.record import check_time, note_rounded_time, uniform_step


@pytest.mark.parametrize("written", ["{:.4f}", "{:.5g}", "{:.3e}", "{:.2f}"])
def test_a_uniform_clock_that_a_file_rounded_is_one(written: str) -> None:
    clock = 0.3 + np.arange(4000) / 5120
    rounded = np.array([float(written.format(instant)) for instant in clock])
    # The line through many rounded instants is better than one of them, by the square root of some hundred of them.
    assert np.abs(check_time(rounded, len(rounded)) - clock).max() < max(2e-5, 0.05 * np.diff(rounded).max())
    assert len(note_rounded_time(rounded)) == (np.diff(rounded) <= 0).any()


def test_instants_that_no_constant_rate_makes_are_refused() -> None:
    clock = np.arange(1000) / 5120
    for wrong in (
        np.round(np.where(clock > 0.1, clock + 0.01, clock), 3),
        np.where(clock == clock[500], clock[499], clock),
    ):
        with pytest.raises(CampaignError, match="does not rise"):
            check_time(wrong, 1000)


def test_a_clock_that_jumps_is_left_as_it_is() -> None:
    clock = np.round(np.arange(1000) / 512, 4)
    clock[500:] += 0.01
    assert np.array_equal(check_time(clock, 1000), clock)
    with pytest.raises(CampaignError, match="steps of time"):
        uniform_step(clock)


def test_a_record_of_a_rounded_time_has_the_clock_of_its_rate(tmp_path: Path) -> None:
    clock = np.arange(500) / 1024
    table = np.stack([np.round(clock, 2), np.cos(clock)], axis=1)
    np.savetxt(tmp_path / "r.csv", table, delimiter=",", header="time,a [m]", comments="", fmt=["%.2f", "%.9g"])
    record = record_of_columns(read_file(tmp_path / "r.csv"), name="r", units={"a [m]": "m"})
    assert np.abs(record.time - clock).max() < 1e-3
