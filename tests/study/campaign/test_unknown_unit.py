"""A unit that is not understood is never taken for SI, and amplitudes are what their labels say."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from correlation.campaign.read_campaign import read_campaign
from correlation.campaign.signal_entry import SignalEntry
from correlation.errors import CampaignError
from correlation.file.column import Column, MeasuredFile, Point
from correlation.file.read_file import read_file
from correlation.file.uff.write_uff import write_uff
from study.campaign.column_role import Role, recognise_column
from study.campaign.new_campaign import draft_campaign, read_folder, write_manifest
from study.campaign.question import Assumptions
from tests.study.campaign.drafted_folder import FREQUENCY, ONES, drafted, receptance, write_csv

SIZE, PHASE = np.abs(receptance(FREQUENCY)), np.degrees(np.angle(receptance(FREQUENCY)))


def write_sweep(path: Path, header: str, force: float, displacement: float) -> None:
    columns = (FREQUENCY, force * ONES, displacement * SIZE, PHASE)
    rows = [";".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")


def largest(folder: Path) -> float:
    """Largest response per force [m/N], peak over peak, as the campaign reads it."""
    measured = read_campaign(folder).measurement
    return float(np.abs(measured.value / measured.force).max())


@pytest.mark.parametrize(
    "label",
    [
        "[furlong]",
        "(furlong)",
        "(mm/furlong)",
        "/ furlong",
        "in µinch",
        ", furlong",
        "µinch",
        "[a.u.]",
        "[dBm]",
        "[mm/foo]",
    ],
)
def test_a_response_in_an_unknown_unit_is_left_out_by_name_with_the_remedy(tmp_path: Path, label: str) -> None:
    rows = [f"{f};1;{x:.9g};{x:.9g}" for f, x in zip(FREQUENCY, SIZE, strict=True)]
    header = f"f [Hz];force [N];tip [m];Disp{' ' * (label[0] != ',')}{label}"
    (tmp_path / "sine.csv").write_text("\n".join([header, *rows]), encoding="utf-8")
    campaign, manifest = drafted(tmp_path)
    assert [sensor["name"] for sensor in manifest["sensor"]] == ["tip displacement"]
    assert any("Disp" in text and "is not used" in text and "write a unit" in text for text in campaign.draft.left_out)


@pytest.mark.parametrize(
    "label",
    [
        "Disp (a.u.)",
        "Disp (1e-3 m)",
        "Disp / 0.1mm",
        "Disp (x1000)",
        "Disp (mm*10)",
        "Disp dm",
        "disp_yd",
        "Kraft daN",
        "force_dyn",
        "Force [counts]",
        "Time (samples)",
        "time_ticks",
        "Disp_µstrain",
        "Acc m/s^3",
        "Zeit in h",
        "Acc (dm/s²)",
        "Force (dyn)",
        "Time [fortnight]",
        "Frequency [foo]",
        "Phase [rev]",
    ],
)
def test_any_channel_with_an_unknown_unit_is_not_used(label: str) -> None:
    assert recognise_column(Column(name=label, values=np.linspace(1, 5, 20)), label).role is Role.OTHER


@pytest.mark.parametrize(
    "name",
    [
        "disp_rel",
        "acc_h",
        "disp tip",
        "acc 12Z",
        "acc (12Z)",
        "acc (H1)",
        "acc (3 N)",
        "disp (80 Hz)",
        "acc [counts]",
        "acc_left",
        "disp out",
        "acc (x1)",
        "acc (left pad)",
        "acc (tip)",
        "acc [0]",
        "acc [z]",
        "acc (rod)",
        "disp (raw)",
        "x",
    ],
)
def test_a_place_in_brackets_is_no_unit(name: str) -> None:
    assert recognise_column(Column(name=name, values=np.linspace(1, 5, 20)), name).role is Role.RESPONSE


def test_a_cell_of_a_row_of_units_that_is_not_understood_is_no_si(tmp_path: Path) -> None:
    write_csv(tmp_path / "sine.csv", "f,force,tip,mid\nHz,N,m,furlong", FREQUENCY, ONES, SIZE, SIZE)
    campaign, manifest = drafted(tmp_path)
    assert [sensor["name"] for sensor in manifest["sensor"]] == ["tip displacement"]
    assert any("furlong" in text for text in campaign.draft.left_out)


def test_a_campaign_of_unknown_units_alone_is_refused_by_name(tmp_path: Path) -> None:
    write_csv(tmp_path / "sine.csv", "f [Hz],force [N],Disp [furlong]", FREQUENCY, ONES, SIZE)
    with pytest.raises(CampaignError, match=r"Disp \[furlong\].*write a unit"):
        write_manifest(measured := read_folder(tmp_path), draft_campaign(measured, Assumptions()))


def test_a_label_of_a_universal_file_that_is_not_understood_is_not_that_of_its_data_type(tmp_path: Path) -> None:
    columns = [Column(name="frequency", values=FREQUENCY, unit="Hz", function="frequency")]
    for node, unit in ((1, "m/N"), (2, "m/N")):
        columns.append(Column(name=str(node), values=receptance(FREQUENCY), unit=unit, abscissa="frequency",
                              function="frequency response", response=Point(node=node, direction="+z"),
                              reference=Point(node=1, direction="+z")))  # fmt: skip
    write_uff(MeasuredFile(path=tmp_path / "a.uff", format="", columns=tuple(columns)), tmp_path / "a.uff")
    text = (tmp_path / "a.uff").read_text()
    assert text.count("m/N") == 2
    (tmp_path / "a.uff").write_text("zap".join(text.rsplit("m/N", 1)))
    campaign, manifest = drafted(tmp_path)
    assert [sensor["name"] for sensor in manifest["sensor"]] == ["1Z"]
    assert any("zap" in sentence for sentence in campaign.draft.left_out)


@pytest.mark.parametrize(
    ("force", "displacement", "factor"),
    [
        ("Force [N pk]", "Displacement [mm p-p]", (1.0, 2.0)),
        ("Force [N]", "Displacement [mm pp]", (1.0, 2.0)),
        ("Force [N]", "Displacement [mm rms]", (1.0, 0.5**0.5)),
        ("Force RMS [N]", "Displacement RMS [mm]", (0.5**0.5, 0.5**0.5)),
        ("Force [N rms]", "Displacement [mm]", (0.5**0.5, 0.5**0.5)),
        ("Force [N rms]", "Displacement [mm 0-pk]", (0.5**0.5, 1.0)),
    ],
)
@pytest.mark.parametrize("phase", [";Phase [deg]", ";remark"])
def test_amplitudes_are_what_their_labels_say(
    tmp_path: Path, force: str, displacement: str, factor: tuple[float, float], phase: str
) -> None:
    write_sweep(
        tmp_path / "sine_3N.csv", f"Frequency [Hz];{force};{displacement}{phase}", 3 * factor[0], 3e3 * factor[1]
    )
    campaign, _ = drafted(tmp_path)
    assert largest(tmp_path) == pytest.approx(SIZE.max(), rel=1e-6)
    assert read_campaign(tmp_path).levels == pytest.approx([3.0], rel=5e-3)  # three digits of a median
    assert not any("in its name" in sentence for sentence in campaign.suspicions)


def test_a_line_above_the_table_says_what_amplitudes_are(tmp_path: Path) -> None:
    write_sweep(tmp_path / "sine_3N.csv", "Amplitude: RMS\nFrequency [Hz];Force [N];Displacement [m];Phase [deg]", 3, 3)
    assert drafted(tmp_path)[1]["convention"]["amplitude"] == "rms"


@pytest.mark.parametrize(("lines", "said"), [("Spectrum (RMS)", "rms"), ("RMS averaging", "peak")])
def test_identification_lines_say_what_amplitudes_are_and_averages_do_not(
    tmp_path: Path, lines: str, said: str
) -> None:
    facts = {"line 1": lines}
    sizes: list[tuple[str, Any, int]] = [("N", ONES + 0j, 1), ("m", receptance(FREQUENCY), 2)]
    columns = [Column(name="frequency", values=FREQUENCY, unit="Hz", function="frequency")]
    columns += [Column(name=unit, values=values, unit=unit, abscissa="frequency", function="spectrum", facts=facts,
                       response=Point(node=node, direction="+z")) for unit, values, node in sizes]  # fmt: skip
    write_uff(MeasuredFile(path=tmp_path / "a.uff", format="", columns=tuple(columns)), tmp_path / "a.uff")
    _, manifest = drafted(tmp_path)
    assert manifest["convention"]["amplitude"] == said


def decay() -> tuple[np.ndarray, np.ndarray]:
    time = np.arange(4000) / 2000
    return time, 2e-4 * np.exp(-3 * time) * np.sin(2 * np.pi * 50 * time)


@pytest.mark.parametrize("unit", ["Strain", "µm/m", "ustrain", "µε"])
def test_a_strain_is_a_displacement_of_unknown_gain(tmp_path: Path, unit: str) -> None:
    write_csv(tmp_path / "decay.csv", f"time [s],gauge 1 [{unit}]", *decay())
    campaign, manifest = drafted(tmp_path)
    assert manifest["sensor"][0]["quantity"] == "displacement"
    value = manifest["ring_down"][0]["columns"]["value"]
    assert value == {"column": f"gauge 1 [{unit}]", "unit": "strain", "sensitivity": "1 strain/(m)"}
    assert any("sensitivity" in sentence and "strain" in sentence for sentence in campaign.draft.assumptions())


def test_a_sensitivity_scales_a_strain(tmp_path: Path) -> None:
    time, strain = decay()
    write_csv(tmp_path / "decay.csv", "time [s],gauge [strain]", time, strain)
    entry = SignalEntry(
        where="", columns={"column": "gauge [strain]"}, unit="strain", sensitivity="20 strain/(km)"
    )  # fmt: skip
    np.testing.assert_allclose(entry.real_values(read_file(tmp_path / "decay.csv"), "m"), strain / 20e-3, rtol=1e-12)


def test_a_stepped_sine_of_a_strain_gauge_is_not_calibrated(tmp_path: Path) -> None:
    header = "f [Hz],F [N],gauge amplitude [strain],gauge phase [deg]"
    x = receptance(FREQUENCY)
    write_csv(tmp_path / "sine.csv", header, FREQUENCY, ONES, np.abs(x), np.degrees(np.angle(x)))
    (sensor,) = drafted(tmp_path)[1]["sensor"]
    assert (sensor["quantity"], sensor["calibrated"], sensor["reading_unit"]) == ("displacement", False, "strain")


def test_a_strain_over_a_force_is_no_loop(tmp_path: Path) -> None:
    turn = 2 * np.pi * np.arange(4000) / 500
    write_csv(tmp_path / "hysteresis.csv", "time [s],F [N],gauge [strain]", turn, np.sin(turn + 0.3), np.sin(turn))
    assert "loop" not in drafted(tmp_path)[1]
