"""Signals at the door: clocks that a file has rounded."""

import re
from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.time_record import make_record_of_columns
from correlation.errors import CampaignError
from correlation.file.read_file import read_file
from correlation.signal.record import check_time, compute_uniform_step, note_rounded_time


@pytest.mark.parametrize("written", ["{:.4f}", "{:.5g}", "{:.3e}", "{:.2f}"])
def test_a_uniform_clock_that_a_file_rounded_is_one(written: str) -> None:
    clock = 0.3 + np.arange(4000) / 5120
    rounded = np.array([float(written.format(instant)) for instant in clock])
    # The line through many rounded instants is better than one of them, by the square root of some hundred of them.
    assert np.abs(check_time(rounded, len(rounded)) - clock).max() < max(2e-5, 0.05 * np.diff(rounded).max())
    rate = float(re.search(r"constant rate of (\S+) Hz", *note_rounded_time(rounded))[1])  # type: ignore[index]
    # Rounding by up to 0.01 s over a record of 0.8 s, averaged over some hundred instants.
    assert rate == pytest.approx(5120, rel=2e-3)


def test_a_clock_of_five_digits_but_four_decimals_at_least_is_one() -> None:
    clock = np.arange(40000) / 3004.8
    rounded = np.array([float(f"{instant:.5g}" if instant < 10 else f"{instant:.4f}") for instant in clock])
    # Half of the last digit is 5e-5 s, and the line through 40000 instants is better than one of them.
    assert np.abs(check_time(rounded, len(rounded)) - clock).max() < 5e-6
    assert "3004.8 Hz" in note_rounded_time(rounded)[0]


def test_a_clock_that_is_written_well_is_not_worth_a_word() -> None:
    for clock in (np.arange(1000) / 5000, np.round(np.arange(1000) / 5120, 7), np.linspace(0, 1, 700) ** 2):
        assert not note_rounded_time(np.round(clock, 9))


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
        compute_uniform_step(clock)


def test_a_sample_that_is_missing_is_no_rounding() -> None:
    clock = np.delete(np.arange(100) / 1000, 60)
    for written in (clock, np.round(clock, 3)):
        assert np.array_equal(check_time(written, 99), written)
        assert not note_rounded_time(written)
        with pytest.raises(CampaignError, match="steps of time"):
            compute_uniform_step(check_time(written, 99))


def test_a_record_of_a_rounded_time_has_the_clock_of_its_rate(tmp_path: Path) -> None:
    clock = np.arange(500) / 1024
    table = np.stack([np.round(clock, 2), np.cos(clock)], axis=1)
    np.savetxt(tmp_path / "r.csv", table, delimiter=",", header="time,a [m]", comments="", fmt=["%.2f", "%.9g"])
    record = make_record_of_columns(read_file(tmp_path / "r.csv"), name="r", units={"a [m]": "m"})
    assert np.abs(record.time - clock).max() < 1e-3
    assert len(record.remarks) == 1


def test_a_record_whose_steps_alone_are_rounded_has_one_rate_and_a_remark(tmp_path: Path) -> None:
    clock = np.arange(500) / 4096
    table = np.stack([np.round(clock, 4), np.cos(clock)], axis=1)
    np.savetxt(tmp_path / "r.csv", table, delimiter=",", header="time,a [m]", comments="", fmt=["%.4f", "%.9g"])
    record = make_record_of_columns(read_file(tmp_path / "r.csv"), name="r", units={"a [m]": "m"})
    # Of 500 instants that are off by 3e-5 s the line through them is known to a few 1e-6 s.
    assert np.abs(record.time - clock).max() < 1e-5
    assert record.step == pytest.approx(1 / 4096, rel=1e-4)
    assert "4096" in record.remarks[0] or "4095.9" in record.remarks[0]
