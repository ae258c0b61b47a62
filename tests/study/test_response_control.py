"""`stickslip solve` with the amplitude of a sensor held: force of a linear mass and of a shaken one, and refusals."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from study import cli

MASS, STIFFNESS, DAMPING = 1.0, 1e6, 20.0
#: The level is found to the solver's tolerance, and the netCDF file keeps all digits.
TOLERANCE = 1e-7
CASE = """\
schema = 2
[structure]
kind = "plain"
file = "mass.npz"
[[load]]
LOAD
[[sensor]]
name = "mass"
dof = 0
quantity = "acceleration"
gain = 2
[[sensor]]
name = "other"
dof = 0
[sweep]
control = "mass"
amplitudes = ["3 m/s^2", "1 m/s^2"]
from = "140 Hz"
to = "180 Hz"
"""
FORCE = 'dof = 0\namplitude = "4 N"\nphase = "30 deg"'
BASE = 'base = [1.0]\nvelocity = "5 mm/s"'


def solved(home: Path, load: str) -> xr.Dataset:
    np.savez(home / "mass.npz", M=[[MASS]], K=[[STIFFNESS]], C=[[DAMPING]])
    (home / "held.toml").write_text(CASE.replace("LOAD", load))
    assert cli.main(["solve", "held.toml", "--out", "out", "--json"]) == 0
    return xr.open_dataset(home / "out" / "held_response.nc")


def held_amplitudes(data: xr.Dataset) -> np.ndarray:
    return np.asarray(np.where(data.curve.values == 0, 3.0, 1.0))


def test_level_of_a_linear_mass_is_amplitude_over_receptance(at_home: Path) -> None:
    data = solved(at_home, FORCE)
    omega = 2 * np.pi * data.frequency.values
    accelerance = omega**2 / np.abs(STIFFNESS - omega**2 * MASS + 1j * omega * DAMPING)
    wanted = held_amplitudes(data) / (2 * 4.0 * accelerance)
    np.testing.assert_allclose(data.level, wanted, rtol=TOLERANCE)
    assert set(data.curve.values) == {0, 1}
    assert (at_home / "out" / "held_force.png").exists()
    assert not (at_home / "out" / "held_response_1.png").exists()  # straight lines


def test_level_of_a_shaken_mass_is_amplitude_over_transmissibility(at_home: Path) -> None:
    data = solved(at_home, BASE)
    omega = 2 * np.pi * data.frequency.values
    spring = STIFFNESS + 1j * omega * DAMPING
    absolute = np.abs(spring / (spring - omega**2 * MASS))
    wanted = held_amplitudes(data) / (2 * 5e-3 * omega * absolute)
    np.testing.assert_allclose(data.level, wanted, rtol=TOLERANCE)


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ('control = "mass"', 'control = "maas"', '"maas"'),
        ('"1 m/s^2"', '"1 um"', '"1 um"'),
        ('"1 m/s^2"', '"-1 m/s^2"', '"-1 m/s^2"'),
        ('"1 m/s^2"', "1.0", "1.0"),
        ("[sweep]", "[sweep]\nlevels = [1]", "levels"),
        ("[sweep]", '[harmonics]\ntolerance = "1 %"\n[sweep]', "tolerance"),
    ],
)
def test_what_cannot_be_held_is_refused_with_its_value(
    old: str, new: str, named: str, at_home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    np.savez(at_home / "mass.npz", M=[[MASS]], K=[[STIFFNESS]], C=[[DAMPING]])
    (at_home / "held.toml").write_text(CASE.replace("LOAD", FORCE).replace(old, new))
    assert cli.main(["solve", "held.toml", "--out", "out"]) == 2
    message = capsys.readouterr().err
    assert "held.toml" in message
    assert named in message


@pytest.mark.parametrize("command", [["sweep", "held.toml", "zeta=1,2"], ["limits", "held.toml"]])
def test_commands_that_need_levels_refuse_held_amplitudes(
    command: list[str], at_home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    np.savez(at_home / "mass.npz", M=[[MASS]], K=[[STIFFNESS]], C=[[DAMPING]])
    (at_home / "held.toml").write_text(CASE.replace("LOAD", FORCE))
    assert cli.main([*command, "--out", "out"]) == 2
    assert "level" in capsys.readouterr().err
