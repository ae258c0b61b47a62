"""Whole numbers of a converter: the draft marks their scale as assumed, and a sensitivity makes them a motion."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
import scipy.io.wavfile

from correlation.campaign.read_campaign import read_campaign
from correlation.campaign.signal_entry import SignalEntry
from correlation.errors import CampaignError
from correlation.file.read_file import read_file
from study.campaign.new_campaign import NewCampaign, draft_campaign, read_folder, write_manifest
from study.campaign.question import Assumptions

RATE = 2048
TIME = np.arange(2 * RATE) / RATE
DECAY = np.exp(-3.0 * TIME) * np.cos(2 * np.pi * 40.0 * TIME)
#: Counts of a converter of 16 bits at its full scale of 50 m/s^2.
FULL_SCALE = 2.0**15


def write_wav(path: Path, values: np.ndarray) -> None:
    scipy.io.wavfile.write(path, RATE, np.round((FULL_SCALE - 1) * values).astype(np.int16))


def drafted(folder: Path) -> NewCampaign:
    return write_manifest(measured := read_folder(folder), draft_campaign(measured, Assumptions()))


def test_counts_are_marked_as_of_unknown_scale_and_scaled_by_their_sensitivity(tmp_path: Path) -> None:
    write_wav(tmp_path / "acc_tip.wav", DECAY)
    campaign = drafted(tmp_path)
    text = campaign.path.read_text()
    value = tomllib.loads(text)["ring_down"][0]["columns"]["value"]
    assert value == {"column": "channel 1", "unit": "count", "sensitivity": "1 count/(m/s^2)"}
    assert any("sensitivity" in sentence and "converter" in sentence for sentence in campaign.draft.assumptions())


@pytest.mark.parametrize(("sensitivity", "unit"), [("655.36 count/(m/s^2)", 50.0), ("65.536 count/(mm/s^2)", 0.5)])
def test_a_sensitivity_scales_counts(tmp_path: Path, sensitivity: str, unit: float) -> None:
    write_wav(tmp_path / "acc.wav", DECAY)
    entry = SignalEntry(where="", columns={"column": "channel 1"}, unit="count", sensitivity=sensitivity)
    file = read_file(tmp_path / "acc.wav")
    counts = np.round((FULL_SCALE - 1) * DECAY)
    np.testing.assert_allclose(entry.real_values(file, "m/s^2"), counts * (unit / FULL_SCALE), rtol=1e-14, atol=0)


def test_counts_without_a_sensitivity_are_refused_with_the_remedy(tmp_path: Path) -> None:
    write_wav(tmp_path / "acc_tip.wav", DECAY)
    path = drafted(tmp_path).path
    path.write_text(path.read_text().replace(', sensitivity = "1 count/(m/s^2)"', ""))
    with pytest.raises(CampaignError, match=r'"channel 1" of acc_tip\.wav.*sensitivity such as "655\.36 count/'):
        read_campaign(tmp_path)


def test_floating_point_numbers_are_no_counts(tmp_path: Path) -> None:
    scipy.io.wavfile.write(tmp_path / "acc_tip.wav", RATE, (50 * DECAY).astype(np.float32))
    campaign = drafted(tmp_path)
    value = tomllib.loads(campaign.path.read_text())["ring_down"][0]["columns"]["value"]
    assert value == {"column": "channel 1", "unit": "m/s^2"}
    assert any('unit of "value" = m/s^2' in sentence for sentence in campaign.draft.assumptions())


@pytest.mark.parametrize(
    ("name", "size", "is_scaled"),
    [("acc_tip", 1e4, True), ("acc_tip [count]", 1e4, True), ("acc_tip [m/s^2]", 1e4, False), ("acc_tip", 1.0, False)],
)
def test_a_decay_of_whole_numbers_without_a_unit_is_marked_as_counts(
    tmp_path: Path, name: str, size: float, is_scaled: bool
) -> None:
    signal = np.round(size * DECAY) if size > 1 else DECAY
    rows = [f"{instant!r},{value!r}" for instant, value in zip(TIME.tolist(), signal.tolist(), strict=True)]
    (tmp_path / "decay.csv").write_text("\n".join([f"time [s],{name}", *rows]))
    value = tomllib.loads(drafted(tmp_path).path.read_text())["ring_down"][0]["columns"]["value"]
    assert (isinstance(value, dict) and value.get("sensitivity") == "1 count/(m/s^2)") == is_scaled


def test_a_steady_state_in_counts_has_sensors_without_calibration(tmp_path: Path) -> None:
    sine = np.cos(2 * np.pi * 20.3 * TIME)
    write_wav(tmp_path / "acc.wav", np.column_stack([sine, 0.5 * sine, 0.2 * sine]))
    manifest = tomllib.loads(drafted(tmp_path).path.read_text())
    assert [(one["calibrated"], one["reading_unit"]) for one in manifest["sensor"]] == [(False, "count")] * 2


@pytest.mark.parametrize(
    ("files", "names"),
    [
        (("acc_tip", "acc_root"), {"tip acceleration", "root acceleration"}),
        (("run1_acc_tip", "run1_acc_root", "run2_acc_tip", "run2_acc_root"), {"tip acceleration", "root acceleration"}),
        (("acc1_free", "acc2_free"), {"acc 1", "acc 2"}),
        (("acc_tip_run1", "acc_tip_run2"), {"channel 1 acceleration"}),
        (("acc_tip_up_1N", "acc_tip_down_2N"), {"channel 1 acceleration"}),
        (("acc_80Hz", "acc_90Hz"), {"channel 1 acceleration"}),
        (("decay_tip", "decay_root"), {"tip", "root"}),
        (("decay_m3_1", "decay_m3_2"), {"channel 1"}),
    ],
)
def test_files_that_name_their_channels_name_a_sensor_each_by_what_differs(
    tmp_path: Path, files: tuple[str, ...], names: set[str]
) -> None:
    for name in files:
        write_wav(tmp_path / f"{name}.wav", DECAY)
    manifest = tomllib.loads(drafted(tmp_path).path.read_text())
    assert sorted(one["name"] for one in manifest["sensor"]) == sorted(names)
    assert len(manifest["ring_down"]) == len(files)
    for decay in manifest["ring_down"]:
        words = decay["sensor"].replace(" acceleration", "").replace(" ", "")
        assert words in decay["file"] or len(names) == 1


def test_several_channels_of_such_files_keep_their_numbers(tmp_path: Path) -> None:
    for name in ("acc_tip", "acc_root"):
        write_wav(tmp_path / f"{name}.wav", np.column_stack([DECAY, 0.5 * DECAY]))
    manifest = tomllib.loads(drafted(tmp_path).path.read_text())
    assert sorted(one["name"] for one in manifest["sensor"]) == [
        f"{place} channel {number} acceleration" for place in ("root", "tip") for number in (1, 2)
    ]


@pytest.mark.parametrize("names", [("acc_hit1", "acc_hit2"), ("acc_before", "acc_after"), ("acc_day1", "acc_day2")])
def test_words_of_runs_are_no_sensors(tmp_path: Path, names: tuple[str, str]) -> None:
    for name in names:
        write_wav(tmp_path / f"{name}.wav", DECAY)
    sensors = tomllib.loads(drafted(tmp_path).path.read_text())["sensor"]
    assert len(sensors) == 1
