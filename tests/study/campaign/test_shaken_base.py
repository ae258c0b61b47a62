"""A vibration controller drives by the acceleration of the base, at the level of its demand."""

from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.read_campaign import read_campaign
from tests.study.campaign.drafted_folder import FREQUENCY, ONES, drafted, receptance, write_csv


def test_control_is_the_acceleration_of_the_base_and_demand_its_level(tmp_path: Path) -> None:
    response = receptance(FREQUENCY) * (2 * np.pi * FREQUENCY) ** 2
    for level in (0.5, 1.0):
        header = "Frequency (Hz),Demand (G),Control (G),Drive (V),Ch2 (G),Ch2 phase (deg)"
        columns = (
            level * ONES,
            1.01 * level * ONES,
            0.2 * ONES,
            level * np.abs(response),
            np.degrees(np.angle(response)),
        )
        write_csv(tmp_path / f"sine_{level}g.csv", header, FREQUENCY, *columns)
    _, manifest = drafted(tmp_path)
    assert manifest["drive"]["quantity"] == "base acceleration"
    assert manifest["units"]["level"] == "g_n"
    assert [sensor["name"] for sensor in manifest["sensor"]] == ["ch 2 acceleration"]
    assert read_campaign(tmp_path).levels == pytest.approx([0.5 * 9.80665, 9.80665])


def test_a_control_without_a_demand_or_a_voltage_is_a_sensor(tmp_path: Path) -> None:
    header = "Frequency (Hz),Force (N),Control (g)"
    write_csv(tmp_path / "sine_1N.csv", header, FREQUENCY, ONES, np.abs(receptance(FREQUENCY)))
    _, manifest = drafted(tmp_path)
    assert [sensor["name"] for sensor in manifest["sensor"]] == ["control acceleration"]
