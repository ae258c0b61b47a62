"""Habits of exporting programs: names that MATLAB made, columns of spreads, runs of unequal length, percentages."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from correlation.campaign.read_campaign import read_campaign
from correlation.file.column import Column
from study.campaign.column_role import Role, recognise_column
from tests.study.campaign.drafted_folder import FREQUENCY, ONES, drafted, receptance, write_csv

RATIO = receptance(FREQUENCY)
TIME = np.arange(4000) / 2000.0
DECAY = np.exp(-TIME / 0.3) * np.cos(2 * np.pi * 80.0 * TIME)


@pytest.mark.parametrize(
    ("name", "role", "unit"),
    [
        ("Acceleration_m_s_2_", Role.RESPONSE, "m/s^2"), ("Time_s_", Role.TIME, "s"), ("Force__N_", Role.FORCE, "N"),
        ("Avg_Angular_Frequency", Role.FREQUENCY, "rad/s"), ("Angle SD", Role.FOREIGN, ""),
        ("tip_stddev", Role.FOREIGN, ""), ("Phase_Error", Role.FOREIGN, ""),
    ],
)  # fmt: skip
def test_names_of_exports_say_units_angular_frequencies_and_spreads(name: str, role: Role, unit: str) -> None:
    guess = recognise_column(Column(name=name, values=np.linspace(1.0, 5.0, 20)), name)
    assert (guess.role, guess.unit) == (role, unit)


def test_a_temperature_that_falls_is_no_time(tmp_path: Path) -> None:
    room = 23.0 + 0.1 * np.sin(np.arange(41))
    savemat(tmp_path / "a.mat", {"Freq_Hz_": FREQUENCY, "T1___C_": room, "Force_N_": ONES, "Tip_m_": np.abs(RATIO)})
    _, manifest = drafted(tmp_path)
    (run,) = manifest["run"]
    assert run["columns"]["frequency"]["column"] == "Freq_Hz_"
    assert "time" not in run["columns"]


def test_a_drive_that_is_zero_in_all_rows_does_not_drive_beside_another(tmp_path: Path) -> None:
    columns = (FREQUENCY, 0 * ONES, 2 * ONES + 0.01 * np.sin(FREQUENCY), np.abs(RATIO))
    write_csv(tmp_path / "a.csv", "f [Hz],generator [V],amplitude of excitation [V],tip [mm]", *columns)
    _, manifest = drafted(tmp_path)
    assert manifest["run"][0]["columns"]["force"]["amplitude"] == "amplitude of excitation [V]"


def test_readings_in_percent_are_those_of_a_sensor_of_unknown_gain(tmp_path: Path) -> None:
    write_csv(tmp_path / "sine_3N.csv", "f [Hz],x [%],phase [deg]", FREQUENCY, np.abs(RATIO), np.angle(RATIO, deg=True))
    _, manifest = drafted(tmp_path)
    (sensor,) = manifest["sensor"]
    assert (sensor["calibrated"], sensor["reading_unit"]) == (False, "percent")


def test_a_run_that_is_shorter_than_others_beside_it_ends_with_its_times(tmp_path: Path) -> None:
    blank = [f"{value:.9g}" if row < 3000 else "" for row, value in enumerate(TIME)]
    short = [f"{value:.9g}" if row < 3000 else "" for row, value in enumerate(DECAY)]
    header = "Time (s) Run #1,Disp (mm) Run #1,Time (s) Run #2,Disp (mm) Run #2"
    write_csv(tmp_path / "decays.csv", header, blank, short, TIME, DECAY)
    _, manifest = drafted(tmp_path)
    assert len(manifest["sensor"]) == 1
    pairs = [(one["columns"]["time"], one["columns"]["value"]) for one in manifest["ring_down"]]
    assert pairs == [(f"Time (s) Run #{run}", f"Disp (mm) Run #{run}") for run in (1, 2)]
    lengths = [len(decay.time) for decay in read_campaign(tmp_path).data]  # type: ignore[attr-defined]
    assert lengths == [3000, 4000]


def test_a_second_time_is_no_motion(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).normal(size=len(TIME))
    write_csv(tmp_path / "a.csv", "Time (s),Clock (s),input (V),output (V)", TIME, TIME + 0.5, noise, DECAY + noise)
    _, manifest = drafted(tmp_path)
    assert all("Clock" not in name for name in manifest["record"][0]["units"])


def test_rows_without_a_setting_belong_to_no_series(tmp_path: Path) -> None:
    levels = [*(["1"] * 20), *(["3"] * 20), ""]
    write_csv(
        tmp_path / "a.csv", "f [Hz],level,force [N],tip [mm]", FREQUENCY, levels, 2 + 0.1 * RATIO.real, np.abs(RATIO)
    )
    _, manifest = drafted(tmp_path)
    assert [run["rows"] for run in manifest["run"]] == [{"level": 1.0}, {"level": 3.0}]
