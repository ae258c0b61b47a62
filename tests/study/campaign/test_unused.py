"""What a draft does not read is named, with what to do about it."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from correlation.campaign.read_campaign import read_campaign
from correlation.errors import CampaignError
from correlation.file.column import Column, MeasuredFile, Point
from correlation.file.uff.write_uff import write_uff
from tests.study.campaign.drafted_folder import FREQUENCY, drafted, receptance, write_csv

POINT = Point(node=12, direction="+z")
HEADER = "f [Hz],Force [N],Displacement [m],Phase [rad]"


def sweep(level: float) -> list[Any]:
    values = level * receptance(FREQUENCY)
    return [FREQUENCY, level + 0 * FREQUENCY, np.abs(values), np.angle(values)]


def refusal(folder: Path) -> str:
    with pytest.raises(CampaignError) as error:
        drafted(folder)
    return str(error.value)


def test_columns_without_names_are_to_be_named(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "sine_3N.dat", np.column_stack(sweep(3.0)))
    savemat(tmp_path / "sine_1N.mat", {"data": np.column_stack(sweep(1.0))})
    message = refusal(tmp_path)
    assert "[run.columns]" in message
    assert '"data(:,1)"' in message


def test_folders_within_are_named(tmp_path: Path) -> None:
    (tmp_path / "3N").mkdir()
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "plan.md").write_text("text")
    write_csv(tmp_path / "3N" / "sweep.csv", HEADER, *sweep(3.0))
    assert "3N: subfolders" in refusal(tmp_path)
    write_csv(tmp_path / "sweep.csv", HEADER, *sweep(3.0))
    (sentence,) = drafted(tmp_path)[0].draft.left_out
    assert sentence.startswith("3N: ")


def test_a_transmissibility_is_named_with_the_drive_that_it_needs(tmp_path: Path) -> None:
    column = Column(
        name="a", values=receptance(FREQUENCY), unit="(g_n)/(g_n)", abscissa="frequency", response=POINT,
        function="frequency response", reference=Point(node=99, direction="+z"),
    )  # fmt: skip
    first = Column(name="frequency", values=FREQUENCY, unit="Hz")
    write_uff(MeasuredFile(path=tmp_path / "a.uff", format="", columns=(first, column)), tmp_path / "a.uff")
    assert '"base acceleration"' in refusal(tmp_path)


def test_a_strain_is_left_out_and_the_motion_beside_it_stays(tmp_path: Path) -> None:
    columns = sweep(3.0)
    write_csv(tmp_path / "sine_3N.csv", HEADER.replace(",Phase", ",Strain [µm/m],Phase"), *columns[:3], *columns[2:])
    campaign, manifest = drafted(tmp_path)
    assert len(manifest["sensor"]) == 1
    assert any('"Strain [µm/m]" is not used' in sentence for sentence in campaign.draft.left_out)


def test_complex_numbers_without_a_frequency_are_named(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"acc": np.tile(receptance(FREQUENCY), 10)})
    assert "complex, and it has no frequency" in refusal(tmp_path)


def test_structures_of_a_value_and_a_unit_are_one_table(tmp_path: Path) -> None:
    frequency, force, size, phase = sweep(3.0)
    values = {
        "freq": {"value": frequency, "unit": "Hz"}, "force": {"value": force, "unit": "N"},
        "acc": {"value": size * np.exp(1j * phase), "unit": "g"},
    }  # fmt: skip
    savemat(tmp_path / "sine_3N.mat", values)
    drafted(tmp_path)
    np.testing.assert_allclose(
        read_campaign(tmp_path).measurement.value, 9.80665 * size * np.exp(1j * phase), rtol=1e-9
    )


def test_groups_of_one_array_are_runs(tmp_path: Path) -> None:
    import h5py

    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["frequency"] = FREQUENCY
        for level in (1.0, 3.0):
            file[f"level_{level:g}N/values"] = receptance(FREQUENCY)
    _, manifest = drafted(tmp_path)
    assert [run["level"] for run in manifest["run"]] == [1.0, 3.0]


def test_of_two_forces_of_a_record_one_drives(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    noise = rng.standard_normal((3, 2000))
    header = "time [s],force [N],force reaction [N],acc [m/s^2]"
    write_csv(tmp_path / "noise.csv", header, np.arange(2000) / 1000.0, *noise)
    campaign, manifest = drafted(tmp_path)
    (record,) = manifest["record"]
    assert record["force"] == "force [N]"
    assert any('"force reaction [N]"' in sentence for sentence in campaign.draft.left_out)


def test_frequencies_below_zero_tell_no_sign(tmp_path: Path) -> None:
    frequency = np.linspace(-200.0, 200.0, 801)
    values = receptance(np.abs(frequency))
    values = np.where(frequency < 0, np.conj(values), values)
    write_csv(tmp_path / "frf.csv", "f [Hz],Re [m/N],Im [m/N]", frequency, values.real, values.imag)
    campaign, manifest = drafted(tmp_path)
    assert "sign" not in str(manifest["frf"]) + " ".join(campaign.suspicions)


def test_a_folder_of_other_files_names_them(tmp_path: Path) -> None:
    (tmp_path / "loop_30lb.json").write_text('{"data": [[0.0, 1.0]]}')
    message = refusal(tmp_path)
    assert "loop_30lb.json" in message
    assert "CSV" in message


def test_the_first_of_columns_without_names_is_said_to_rise_in_equal_steps(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "decay.txt", np.column_stack([np.arange(300) / 100, np.cos(np.arange(300))]))
    assert '"column 1" goes from 0 to 2.99 in equal steps' in refusal(tmp_path)
