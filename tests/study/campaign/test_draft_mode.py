"""Mode shapes of universal files become modes of the manifest, or are left out with a reason."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from correlation.campaign.read_campaign import read_campaign
from correlation.data_type.mode import MeasuredMode
from study.campaign.new_campaign import NewCampaign, draft_campaign, read_folder, write_manifest
from study.campaign.question import Assumptions
from study.campaign.table import split_tables
from study.campaign.table_kind import Kind, judge_table

NODES = {11: (0.0, 0.0, 0.0), 12: (0.1, 0.0, 0.0), 13: (0.2, 0.0, 0.0)}


def dataset(kind: int, lines: list[str]) -> str:
    return "\n".join(["    -1", f"{kind:6d}", *lines, "    -1"]) + "\n"


def nodes_15() -> str:
    return dataset(15, [f"{n:10d}{0:10d}{0:10d}{8:10d}" + "".join(f"{x:13.5e}" for x in at) for n, at in NODES.items()])


def shape_55(analysis: int, real: list[float], values: dict[int, list[Any]], number: int = 1) -> str:
    """Dataset 55 as its description says, with three values per node."""
    is_complex = analysis == 3
    head = ["NONE"] * 5 + ["".join(f"{n:10d}" for n in (1, analysis, 2, 8, 5 if is_complex else 2, 3))]
    head += ["".join(f"{n:10d}" for n in (2, len(real), 1, number))]
    head += ["".join(f"{x:13.5e}" for x in real)]
    for node, row in values.items():
        parts = [part for x in row for part in ((x.real, x.imag) if is_complex else (x,))]
        head += [f"{node:10d}", "".join(f"{x:13.5e}" for x in parts)]
    return dataset(55, head)


def drafted(folder: Path, text: str) -> tuple[NewCampaign, list[MeasuredMode]]:
    (folder / "modes.uff").write_text(text)
    campaign = write_manifest(measured := read_folder(folder, overwrite=True), draft_campaign(measured, Assumptions()))
    return campaign, [datum for datum in read_campaign(folder).data if isinstance(datum, MeasuredMode)]


def test_normal_modes_come_with_frequency_damping_and_the_moving_axes_of_their_shape(tmp_path: Path) -> None:
    first = {11: [0.0, 0.0, 0.5], 12: [0.0, 0.0, 0.8], 13: [0.0, 0.0, 1.0]}
    second = {11: [0.0, 0.0, 1.0], 12: [0.0, 0.0, 0.2], 13: [0.0, 0.0, -0.9]}
    text = nodes_15() + shape_55(2, [86.92, 1.0, 0.004, 0.0], first) + shape_55(2, [153.9, 1.0, 0.0, 0.01], second, 2)
    campaign, modes = drafted(tmp_path, text)
    assert [mode.sensors for mode in modes] == [("11Z", "12Z", "13Z")] * 2
    np.testing.assert_allclose([mode.frequency for mode in modes], [86.92, 153.9])
    # A loss factor is twice the damping ratio.
    np.testing.assert_allclose([mode.damping for mode in modes], [0.004, 0.005])
    np.testing.assert_allclose(modes[1].shape, [1.0, 0.2, -0.9])
    assert [entry["coordinates"][0] for entry in campaign.draft.entries["sensor"]] == ["0 m", "0.1 m", "0.2 m"]
    assert not campaign.draft.left_out


def test_a_complex_mode_gives_the_nearest_real_shape_and_the_frequency_of_its_eigenvalue(tmp_path: Path) -> None:
    omega, turn = 2 * math.pi * 100.0, np.exp(0.7j)
    eigenvalue = omega * (-0.01 + 1j * math.sqrt(1 - 0.01**2))
    real = {11: 1.0, 12: -0.5, 13: 0.25}
    shape = {node: [0j, turn * value * (1 + 0.01j * (node == 12)), 0j] for node, value in real.items()}
    residual = [eigenvalue.real, eigenvalue.imag, 1.0, 0.0, 0.0, 0.0]
    _, (mode,) = drafted(tmp_path, nodes_15() + shape_55(3, residual, shape))
    # Six digits in the file.
    np.testing.assert_allclose([mode.frequency, mode.damping], [100.0, 0.01], rtol=1e-4)
    # One per cent of one value does not turn the shape by more than its own size.
    np.testing.assert_allclose(mode.shape / mode.shape[0], [1.0, -0.5, 0.25], atol=5e-3)


def test_what_is_no_mode_is_left_out_with_its_place_and_reason(tmp_path: Path) -> None:
    shape = {11: [0.0, 0.0, 0.5], 12: [0.0, 0.0, 0.8]}
    one_point = {11: [0.0, 0.0, 0.5], 12: [0.0, 0.0, math.nan]}
    text = (
        nodes_15()
        + shape_55(2, [0.0, 1.0, 0.0, 0.0], shape)
        + shape_55(5, [50.0], shape)
        + shape_55(2, [60.0, 1.0, 0.0, 0.0], one_point)
        + dataset(82, ["         1         2         0", "NONE", "        11        12"])
    )
    campaign, (mode,) = drafted(tmp_path, text)
    assert (mode.frequency, mode.sensors, math.isnan(mode.damping)) == (60.0, (), True)
    assert not campaign.draft.entries["sensor"]
    told = campaign.draft.left_out
    assert len(told) == 4
    for words in ("dataset 2, line", "frequency response", "needs two moving points, and its shape has 1", "82"):
        assert any(words in sentence for sentence in told), words


def test_nodes_that_no_file_places_are_asked_for_once(tmp_path: Path) -> None:
    shape = {11: [0.0, 0.0, 0.5], 12: [0.0, 0.0, 0.8]}
    campaign, (mode,) = drafted(tmp_path, shape_55(2, [60.0, 1.0, 0.002, 0.0], shape))
    assert mode.sensors == ("11Z", "12Z")
    assert any("place = tip" in sentence for sentence in campaign.draft.assumptions())


def drafted_table(folder: Path, text: str) -> tuple[NewCampaign, list[MeasuredMode]]:
    (folder / "natural_frequencies.csv").write_text(text)
    campaign = write_manifest(measured := read_folder(folder), draft_campaign(measured, Assumptions()))
    return campaign, [datum for datum in read_campaign(folder).data if isinstance(datum, MeasuredMode)]


@pytest.mark.parametrize(
    ("head", "damping"),
    [
        ("mode,frequency [Hz],damping [%]", [0.7, 0.74, 0.93]),
        ("mode,f_n (Hz),zeta (-)", [0.007, 0.0074, 0.0093]),
        ("No.,frequency,damping ratio", [0.007, 0.0074, 0.0093]),
        ("index,Eigenfrequenz,damping", [0.7, 0.74, 0.93]),
    ],
)
def test_a_table_of_natural_frequencies_has_a_mode_in_each_row(tmp_path: Path, head: str, damping: list[float]) -> None:
    rows = [f"{n},{f},{d}" for n, f, d in zip((1, 2, 3), (31.68, 88.75, 128.3), damping, strict=True)]
    campaign, modes = drafted_table(tmp_path, "\n".join([head, *rows]) + "\n")
    np.testing.assert_allclose([mode.frequency for mode in modes], [31.68, 88.75, 128.3])
    np.testing.assert_allclose([mode.damping for mode in modes], [0.007, 0.0074, 0.0093])
    assert [mode.name for mode in modes] == [f"natural_frequencies {number}" for number in (1, 2, 3)]
    assert not campaign.draft.entries["run"]
    assert not campaign.draft.left_out


def test_modes_have_the_names_of_their_table_and_its_other_columns_are_left_out(tmp_path: Path) -> None:
    text = "mode,name,frequency [kHz],MAC\n1,bending,0.03168,0.9\n2,torsion,0.08875,0.8\n3,none,0.0,0.7\n"
    campaign, modes = drafted_table(tmp_path, text)
    assert [(mode.name, round(mode.frequency, 6)) for mode in modes] == [("bending", 31.68), ("torsion", 88.75)]
    assert [sentence for sentence in campaign.draft.left_out if '"MAC"' in sentence and "[[mode]]" in sentence]
    assert [sentence for sentence in campaign.draft.left_out if '"none"' in sentence and "[[mode]]" in sentence]


@pytest.mark.parametrize("head", ["index,frequency [Hz],acc_tip", "level [N],frequency [Hz],damping [%]"])
def test_a_table_with_a_response_or_a_level_is_no_table_of_modes(tmp_path: Path, head: str) -> None:
    rows = [f"{n},{30 + 1.1**n},{0.5 + 0.1 * np.sin(n)}" for n in range(1, 25)]
    (tmp_path / "table.csv").write_text("\n".join([head, *rows]) + "\n")
    (table,) = split_tables(read_folder(tmp_path).files["table.csv"])
    assert judge_table(table).kind is not Kind.MODES
