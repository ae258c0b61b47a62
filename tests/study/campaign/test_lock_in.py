"""Tables of lock-in amplifiers: X in phase, Y in quadrature, volts of motions that the phase at a resonance tells."""

from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.read_campaign import read_campaign
from tests.study.campaign.drafted_folder import drafted

FREQUENCY = np.linspace(98.0, 102.0, 41)
#: Of a force of one, for e^{+i Omega t}.
DISPLACEMENT = 1e4 / (100.0**2 - FREQUENCY**2 + 2j * 0.01 * 100.0 * FREQUENCY)
#: Powers of i Omega, and a phase that is that of none of them.
MOTIONS = {"displacement": 1.0, "velocity": 1j, "acceleration": -1.0, "": np.exp(0.25j * np.pi)}


def _write(folder: Path, names: tuple[str, str], response: np.ndarray) -> None:
    rows = [
        (level, frequency, level * value.real, level * value.imag)
        for level in (0.1, 0.2)
        for frequency, value in zip(FREQUENCY, response, strict=True)
    ]
    text = "\n".join(",".join(map(repr, map(float, row))) for row in rows)
    (folder / "lock_in.csv").write_text(f"drive [V],f [Hz],{names[0]},{names[1]}\n{text}\n")


@pytest.mark.parametrize("motion", MOTIONS)
def test_x_and_y_are_parts_of_a_motion_that_its_phase_tells(tmp_path: Path, motion: str) -> None:
    response = MOTIONS[motion] * DISPLACEMENT
    _write(tmp_path, ("X1 [V]", "Y1 [V]"), response)
    made, _ = drafted(tmp_path)
    campaign = read_campaign(tmp_path)
    (sensor,) = campaign.sensors
    assert sensor.name == "response 1"
    assert not sensor.calibrated
    assert sensor.quantity == (motion or "displacement")
    told = [line for line in made.draft.assumptions() if "like that of" in line]
    assert len(told) == bool(motion)
    table = campaign.measurement
    for level in (0.1, 0.2):
        rows = table.level == level
        value = table.value[rows][np.argsort(table.frequency[rows])]
        np.testing.assert_allclose(value, level * response, rtol=1e-12)


def test_x_and_y_without_a_sign_are_two_axes(tmp_path: Path) -> None:
    _write(tmp_path, ("X [um]", "Y [um]"), np.abs(DISPLACEMENT) * (1 + 0.3j))
    drafted(tmp_path)
    assert len(read_campaign(tmp_path).sensors) == 2
