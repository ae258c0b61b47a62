"""Channels of which only a name says what they measure: forces, microphones, and what the name of a file says."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io
import scipy.io.wavfile
from numpy.typing import NDArray

from correlation.campaign.read_campaign import read_campaign
from correlation.errors import CampaignError
from study.campaign.draft import ManifestDraft
from study.campaign.new_campaign import draft_campaign, read_folder, write_manifest
from study.campaign.question import Assumptions

FREQUENCY = np.linspace(90.0, 110.0, 41)
#: Displacement per force of 1 kg [m/N].
RECEPTANCE = 1.0 / ((200 * np.pi) ** 2 - (2 * np.pi * FREQUENCY) ** 2 + 8j * np.pi**2 * FREQUENCY)
TIME = np.arange(4096) / 2048
DECAY = np.exp(-3 * TIME) * np.sin(2 * np.pi * 100.3 * TIME)


def drafted(folder: Path) -> tuple[ManifestDraft, dict[str, Any]]:
    """A draft with all assumptions, and its manifest."""
    draft = draft_campaign(measured := read_folder(folder), Assumptions())
    return draft, tomllib.loads(write_manifest(measured, draft).path.read_text())


def write_csv(path: Path, **columns: NDArray[np.float64]) -> None:
    rows = "\n".join(",".join(map(repr, map(float, row))) for row in zip(*columns.values(), strict=True))
    path.write_text(f"{','.join(columns)}\n{rows}\n")


def write_file(path: Path, columns: Mapping[str, NDArray[Any]], units: Mapping[str, str]) -> None:
    """A MAT or HDF5 file of columns; HDF5 has their units."""
    if path.suffix == ".mat":
        scipy.io.savemat(path, dict(columns))
        return
    with h5py.File(path, "w") as file:
        for name, values in columns.items():
            file.create_dataset(name, data=values).attrs["unit"] = units.get(name, "")


@pytest.mark.parametrize("suffix", [".mat", ".h5"])
@pytest.mark.parametrize("name", ["force", "F", "Kraft", "load", "F_amp"])
def test_a_force_without_a_unit_is_in_newtons_and_marked(tmp_path: Path, suffix: str, name: str) -> None:
    columns = {"freq": FREQUENCY, name: 3 + 0.1 * np.sin(FREQUENCY), "acc_tip": RECEPTANCE}
    write_file(tmp_path / f"sine{suffix}", columns, {})
    draft, manifest = drafted(tmp_path)
    assert "drive" not in manifest
    assert manifest["units"]["level"] == "N"
    assert manifest["run"][0]["columns"]["force"] == {"amplitude": name, "unit": "N"}
    assert any('unit of "force" = N' in sentence and f'"{name}"' in sentence for sentence in draft.assumptions())
    np.testing.assert_allclose(read_campaign(tmp_path).measurement.force, columns[name], rtol=1e-15)


def test_a_force_whose_unit_is_volts_is_a_drive_of_unknown_gain(tmp_path: Path) -> None:
    columns = {"freq": FREQUENCY, "force": np.full(41, 3.0), "acc_tip": RECEPTANCE}
    write_file(tmp_path / "sine.h5", columns, {"force": "V"})
    _, manifest = drafted(tmp_path)
    assert manifest["drive"]["calibrated"] is False
    assert manifest["units"]["level"] == "V"


def test_beside_no_other_abscissa_f_is_a_frequency(tmp_path: Path) -> None:
    write_file(tmp_path / "sine.mat", {"F": FREQUENCY, "acc_tip": RECEPTANCE}, {})
    assert drafted(tmp_path)[1]["run"][0]["columns"]["frequency"] == {"column": "F", "unit": "Hz"}


def test_a_force_over_time_without_a_unit_drives_steady_states(tmp_path: Path) -> None:
    force, tip = np.cos(2 * np.pi * 80.3 * TIME), np.cos(2 * np.pi * 80.3 * TIME - 1)
    write_csv(tmp_path / "steady.csv", t=TIME, F=force, vel_tip=tip)
    _, manifest = drafted(tmp_path)
    assert manifest["run"][0]["columns"]["force"] == {"column": "F", "unit": "N"}
    assert manifest["sensor"][0]["quantity"] == "velocity"


def test_a_microphone_is_left_out_and_the_others_stay(tmp_path: Path) -> None:
    columns = {"freq": FREQUENCY, "force": np.ones(41), "acc_tip": RECEPTANCE, "mic": RECEPTANCE, "p": RECEPTANCE}
    write_file(tmp_path / "sine.h5", columns, {"p": "Pa"})
    draft, manifest = drafted(tmp_path)
    assert [sensor["name"] for sensor in manifest["sensor"]] == ["acc tip"]
    for name in ("mic", "p"):
        assert sum(f'"{name}" is not used' in sentence for sentence in draft.left_out) == 1


@pytest.mark.parametrize("name", ["microphone.wav", "mic_front.wav"])
def test_a_microphone_alone_cannot_be_compared(tmp_path: Path, name: str) -> None:
    scipy.io.wavfile.write(tmp_path / name, 2048, DECAY.astype(np.float32))
    with pytest.raises(CampaignError, match=rf"{name}: it has no motion.*pressure") as error:
        drafted(tmp_path)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("name", "quantity", "unit"),
    [("velocity", "velocity", "m/s"), ("acc_tip", "acceleration", "m/s^2"), ("Weg_1", "displacement", "m")],
)
def test_the_name_of_a_file_says_what_its_channel_measures(tmp_path: Path, name: str, quantity: str, unit: str) -> None:
    scipy.io.wavfile.write(tmp_path / f"{name}.wav", 2048, DECAY.astype(np.float32))
    draft, manifest = drafted(tmp_path)
    assert [sensor["quantity"] for sensor in manifest["sensor"]] == [quantity]
    assert manifest["ring_down"][0]["columns"]["value"]["unit"] == unit
    assert any(f"quantity = {quantity}" in sentence for sentence in draft.assumptions())


def test_of_two_channels_whose_file_names_a_motion_the_first_drives(tmp_path: Path) -> None:
    noise = np.random.default_rng(3).standard_normal((4096, 2)).astype(np.float32)
    scipy.io.wavfile.write(tmp_path / "velocity.wav", 2048, noise)
    (record,) = drafted(tmp_path)[1]["record"]
    assert record["force"] == "channel 1"
    assert record["units"] == {"channel 1": "V", "channel 2": "m/s"}


def test_motions_alone_have_no_drive_among_them(tmp_path: Path) -> None:
    noise = np.random.default_rng(3).standard_normal((2, 4096))
    write_csv(tmp_path / "noise.csv", **{"time [s]": TIME, "acc 1 [m/s^2]": noise[0], "acc 2 [m/s^2]": noise[1]})
    assert "force" not in drafted(tmp_path)[1]["record"][0]


def test_tables_of_too_few_rows_are_named(tmp_path: Path) -> None:
    write_csv(tmp_path / "decay.csv", **{"time [s]": TIME, "acc [m/s^2]": DECAY})
    write_csv(tmp_path / "short.csv", **{"f [Hz]": FREQUENCY[:2], "F [N]": np.ones(2), "x [m]": np.ones(2)})
    write_csv(tmp_path / "brief.csv", **{"time [s]": TIME[:5], "F [N]": TIME[:5], "x [m]": TIME[:5]})
    write_file(tmp_path / "few.h5", {"f": FREQUENCY[:1], "x": FREQUENCY[:1]}, {})
    draft, manifest = drafted(tmp_path)
    assert [entry["file"] for entry in manifest["ring_down"]] == ["decay.csv"]
    assert "record" not in manifest
    for name, rows in (("short.csv", "2 rows"), ("brief.csv", "5 rows"), ("few.h5", "1 row")):
        assert sum(f"{name}: it has {rows}" in sentence for sentence in draft.left_out) == 1
        assert any(note.file == name and rows in note.evidence for note in draft.notes)


def test_a_sweep_with_phases_stays_beside_one_without(tmp_path: Path) -> None:
    size, angle = np.abs(RECEPTANCE), np.degrees(np.angle(RECEPTANCE))
    write_csv(tmp_path / "a.csv", **{"f [Hz]": FREQUENCY, "F [N]": np.ones(41), "x [m]": size})
    write_csv(tmp_path / "b.csv", **{"f [Hz]": FREQUENCY, "F [N]": np.ones(41), "x [m]": size, "phase [deg]": angle})
    draft, manifest = drafted(tmp_path)
    assert len(manifest["run"]) == 2
    assert not draft.left_out


def test_what_holds_for_all_runs_is_assumed_once(tmp_path: Path) -> None:
    for level in (1.0, 2.0):
        for number in (1, 2):
            x = level * RECEPTANCE * (1 + 0.01 * number)
            columns = {"freq": FREQUENCY, "force": np.full(41, level), "x_amp": np.abs(x), "x_phase": np.angle(x)}
            write_file(tmp_path / f"sweep_{level:g}_{number}.mat", columns, {})
    sentences = drafted(tmp_path)[0].assumptions()
    assert sum("repeat = 1, 2:" in sentence for sentence in sentences) == 1
    assert sum("all 4 runs" in sentence for sentence in sentences) >= 3
    assert not any("from 1 to 1" in sentence or "from 2 to 2" in sentence for sentence in sentences)
    # One sentence of each value and reason.
    assert len({sentence.partition(": ")[2] for sentence in sentences}) == len(sentences)


def test_a_loop_that_slips_is_not_suspected_of_clipping(tmp_path: Path) -> None:
    moved = np.cos(2 * np.pi * 2 * TIME)
    slider, force = 0.0, []
    for value in moved:
        slider += np.sign(value - slider) * max(abs(value - slider) - 0.3, 0.0)
        force.append(value - slider)
    write_csv(tmp_path / "loop.csv", **{"time [s]": TIME, "x [mm]": moved, "F [N]": np.array(force)})
    draft, manifest = drafted(tmp_path)
    assert len(manifest["loop"]) == 1
    assert not any("clip" in sentence for sentence in draft.suspicions)
