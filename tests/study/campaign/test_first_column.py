"""What rises in equal steps and what has no name: times, frequencies, lines of a Fourier transform, spectra."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from correlation.errors import CampaignError
from tests.study.campaign.drafted_folder import drafted, receptance, write_csv

TIME = np.arange(4000) / 2000.0
DECAY = np.exp(-TIME / 0.3) * np.cos(2 * np.pi * 80.0 * TIME)
LINES = np.arange(401) * 0.5
RATIO = receptance(LINES)


def refusal(folder: Path) -> str:
    with pytest.raises(CampaignError) as caught:
        drafted(folder)
    return str(caught.value)


def test_an_array_of_times_and_values_is_a_decay_over_these_times(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"X1": np.stack([TIME, 1e-3 * DECAY], axis=1)})
    _, manifest = drafted(tmp_path)
    (decay,) = manifest["ring_down"]
    assert decay["columns"]["time"] == {"column": "X1(:,1)", "unit": "s"}
    assert decay["columns"]["value"]["column"] == "X1(:,2)"
    assert [one["name"] for one in manifest["sensor"]] == [decay["sensor"]]  # the times are no second motion


def test_an_array_of_frequencies_and_complex_ratios_is_a_frequency_response(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"H1_2": np.stack([LINES, RATIO], axis=1), "S1": np.stack([LINES, 3 * RATIO], axis=1)})
    campaign, manifest = drafted(tmp_path)
    (response,) = manifest["frf"]
    assert response["columns"].pop("frequency") == {"column": "H1_2(:,1)", "unit": "Hz"}
    assert [*response["columns"].values()] == ["H1_2(:,2)"]  # a spectrum is no ratio
    assert any('"S1(:,2)"' in sentence for sentence in campaign.draft.left_out)


def test_beside_two_channels_of_an_array_a_first_column_may_be_either(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"data": np.stack([LINES, RATIO.real, RATIO.imag], axis=1)})
    assert '"data(:,1)" goes from 0 to 200 in equal steps' in refusal(tmp_path)


def test_a_motion_that_rises_in_equal_steps_is_none(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"x": TIME, "y": DECAY})
    assert '"x" goes from 0 to 1.9995 in equal steps' in refusal(tmp_path)


def test_complex_parts_from_zero_hertz_are_frequency_responses(tmp_path: Path) -> None:
    write_csv(tmp_path / "point1.csv", "Frequency [Hz],Real,Imaginary", LINES, RATIO.real, RATIO.imag)
    _, manifest = drafted(tmp_path)
    assert set(manifest) & {"frf", "run"} == {"frf"}


@pytest.mark.parametrize("header", ["tip [mm]", "tip (Real) [mm],tip (Imag) [mm]"])
def test_lines_from_zero_hertz_without_phases_or_in_the_unit_of_a_motion_are_spectra(
    tmp_path: Path, header: str
) -> None:
    parts = (np.abs(RATIO),) if "," not in header else (RATIO.real, RATIO.imag)
    write_csv(tmp_path / "point1.csv", f"Frequency [Hz],{header}", LINES, *parts)
    assert "lines of a Fourier transform" in refusal(tmp_path)


@pytest.mark.parametrize(
    "name", ["Acceleration (FFT - (RMS)) [g]", "MagSpec tip [mm]", "PSD_tip", "acc spectrum [m/s^2]"]
)
@pytest.mark.parametrize("abscissa", ["time [s]", "frequency [Hz]"])
def test_a_spectrum_is_no_motion(tmp_path: Path, name: str, abscissa: str) -> None:
    write_csv(tmp_path / "a.csv", f"{abscissa},{name}", 1 + LINES, np.abs(RATIO))
    assert "in its name a spectrum" in refusal(tmp_path)


def test_a_lower_f_with_both_signs_beside_a_time_is_a_force(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).normal(size=(2, len(TIME)))
    write_csv(tmp_path / "a.csv", "t,x,f", TIME, 1e-3 * noise[0], noise[1])
    _, manifest = drafted(tmp_path)
    (record,) = manifest["record"]
    assert record["force"] == "f"
    assert record["units"]["f"] == "N"


def test_parts_in_brackets_are_those_of_one_response(tmp_path: Path) -> None:
    header = "f [Hz],Signal 2 (Real),Signal 2 (Imag.),Signal 3 (Real),Signal 3 (Imag.)\nHz,m/N,m/N,m/N,m/N"
    write_csv(tmp_path / "a.csv", header, 1 + LINES, RATIO.real, RATIO.imag, RATIO.imag, RATIO.real)
    _, manifest = drafted(tmp_path)
    (response,) = manifest["frf"]
    parts = [one for name, one in response["columns"].items() if name != "frequency"]
    assert parts == [{"real": f"Signal {n} (Real)", "imag": f"Signal {n} (Imag.)"} for n in (2, 3)]


def test_channels_of_one_array_have_the_motion_of_most_of_them(tmp_path: Path) -> None:
    beyond_a_node = np.stack([RATIO, 0.5 * RATIO, -0.3 * RATIO, 0.7 * RATIO], axis=1)
    savemat(tmp_path / "a.mat", {"freq": LINES, "FRF": beyond_a_node})
    _, manifest = drafted(tmp_path)
    assert [sensor["quantity"] for sensor in manifest["sensor"]] == ["displacement"] * 4
