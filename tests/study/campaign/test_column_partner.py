"""Which columns belong together by their names: motions of a drive, phases and coherences of several sensors."""

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io

from correlation.errors import CampaignError
from study.campaign.draft import ManifestDraft
from study.campaign.new_campaign import draft_campaign, read_folder, write_manifest
from study.campaign.question import Assumptions

FREQUENCY = np.linspace(90.0, 110.0, 41)
#: Displacement per force of 1 kg [m/N], and the same at another place.
TIP = 1.0 / ((200 * np.pi) ** 2 - (2 * np.pi * FREQUENCY) ** 2 + 8j * np.pi**2 * FREQUENCY)
ROOT = 0.4 * TIP
FORCE = 3 + 0.1 * np.sin(FREQUENCY)


def drafted(folder: Path) -> tuple[ManifestDraft, dict[str, Any]]:
    """A draft with all assumptions, and its manifest."""
    draft = draft_campaign(measured := read_folder(folder), Assumptions())
    return draft, tomllib.loads(write_manifest(measured, draft).path.read_text())


def write_csv(path: Path, columns: dict[str, np.ndarray]) -> None:
    rows = "\n".join(",".join(map(repr, map(float, row))) for row in zip(*columns.values(), strict=True))
    path.write_text(f"{','.join(columns)}\n{rows}\n")


def polar(names: tuple[str, str], values: np.ndarray) -> dict[str, np.ndarray]:
    return {names[0]: np.abs(values), names[1]: np.angle(values, deg=True)}


@pytest.mark.parametrize("place", ["drive", "shaker", "input", "hammer"])
def test_the_motion_of_a_drive_without_a_unit_is_a_response(tmp_path: Path, place: str) -> None:
    columns = {"frequency": FREQUENCY, "force": FORCE, "acc_tip": TIP, f"acc_{place}": ROOT}
    scipy.io.savemat(tmp_path / "sine.mat", columns)
    _, manifest = drafted(tmp_path)
    assert set(manifest["run"][0]["columns"]) == {"frequency", "force", "acc tip", f"acc {place}"}


@pytest.mark.parametrize("place", ["drive", "shaker", "input", "root"])
@pytest.mark.parametrize("unit", [" [m/s^2]", ""])
def test_the_phase_of_a_drive_belongs_to_its_motion_beside_a_force(tmp_path: Path, place: str, unit: str) -> None:
    columns = {"frequency [Hz]": FREQUENCY, "force [N]": FORCE, "phase force": np.full(41, 90.0)}
    columns |= polar((f"acc_tip{unit}", "phase_tip"), TIP) | polar((f"acc_{place}{unit}", f"phase_{place}"), ROOT)
    write_csv(tmp_path / "sine.csv", columns)
    draft, manifest = drafted(tmp_path)
    read = manifest["run"][0]["columns"]
    assert read["force"]["phase"] == "phase force"
    assert read[f"acc {place}"]["phase"] == f"phase_{place}"
    assert not draft.left_out


def test_without_a_motion_of_the_drive_its_phase_is_that_of_the_force(tmp_path: Path) -> None:
    columns = {"frequency [Hz]": FREQUENCY, "force [N]": FORCE, "phase_drive": np.full(41, 90.0)}
    write_csv(tmp_path / "sine.csv", columns | polar(("acc_tip [m/s^2]", "phase_tip"), TIP))
    assert drafted(tmp_path)[1]["run"][0]["columns"]["force"]["phase"] == "phase_drive"


def test_a_second_force_is_left_out_by_name(tmp_path: Path) -> None:
    columns = {"frequency": FREQUENCY, "force": FORCE, "acc_tip": TIP, "x_shaker": ROOT}
    scipy.io.savemat(tmp_path / "sine.mat", columns)
    draft, _ = drafted(tmp_path)
    assert [sentence for sentence in draft.left_out if '"x_shaker"' in sentence]


@pytest.mark.parametrize("ratio", ["H {} [(m/s^2)/N]", "H1 {} [(m/s^2)/N]", "acc {} [(m/s^2)/N]", "H_{}"])
@pytest.mark.parametrize("coherence", ["coherence {}", "gamma2_{}", "coh_acc_{}"])
def test_phases_and_coherences_belong_to_the_sensors_of_their_names(tmp_path: Path, ratio: str, coherence: str) -> None:
    columns = {"frequency [Hz]": FREQUENCY}
    for name, values in (("tip", TIP), ("root", ROOT)):
        columns |= polar((ratio.format(name), f"phase {name} [deg]"), values)
        columns[coherence.format(name)] = np.full(41, 0.9)
    write_csv(tmp_path / "frf.csv", columns)
    draft, manifest = drafted(tmp_path)
    (entry,) = manifest["frf"]
    read = {sensor: value["phase"] for sensor, value in entry["columns"].items() if sensor != "frequency"}
    assert sorted(read.values()) == ["phase root [deg]", "phase tip [deg]"]
    assert all(phase.split()[1] in sensor for sensor, phase in read.items())
    assert {sensor: coherence.format(phase.split()[1]) for sensor, phase in read.items()} == entry["coherence"]
    assert not draft.left_out


def test_a_coherence_in_percent_is_refused(tmp_path: Path) -> None:
    columns = {"frequency [Hz]": FREQUENCY}
    for name in ("tip", "root"):
        columns |= polar((f"acc_{name} [(m/s^2)/N]", f"phase_{name} [deg]"), TIP)
        columns[f"coherence_{name}"] = np.full(41, 90.0)
    write_csv(tmp_path / "frf.csv", columns)
    with pytest.raises(CampaignError, match=r"is 90 .* a coherence is between 0 and 1"):
        drafted(tmp_path)


def test_what_belongs_to_no_response_of_a_frequency_response_is_left_out_by_name(tmp_path: Path) -> None:
    columns = {"frequency [Hz]": FREQUENCY} | polar(("acc_tip [(m/s^2)/N]", "phase_tip [deg]"), TIP)
    columns |= {"acc_root [(m/s^2)/N]": np.abs(ROOT), "coherence_left": np.full(41, 0.9)}
    columns |= {"coherence_right": np.full(41, 0.9)}
    write_csv(tmp_path / "frf.csv", columns)
    draft, manifest = drafted(tmp_path)
    assert set(manifest["frf"][0]["columns"]) == {"frequency", "acc tip"}
    for name in ("acc_root [(m/s^2)/N]", "coherence_left", "coherence_right"):
        assert [sentence for sentence in draft.left_out if f'"{name}"' in sentence]
