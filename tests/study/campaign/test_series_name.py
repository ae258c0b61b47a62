"""Files whose names differ in other words than level, repeat, direction or sensor are tests of their own."""

import re
import unicodedata
from pathlib import Path

import numpy as np
import pytest

from study.campaign.repeat_doubt import compare_peaks, read_peaks
from study.campaign.run_name import find_levels_in_name, list_condition_words
from tests.study.campaign.drafted_folder import FREQUENCY, drafted, receptance, write_csv

HEADER = "f [Hz],Force [N],Displacement [um],Phase [deg]"


def write_sweeps(folder: Path, natural: dict[str, float], force: bool = True) -> None:
    """A sweep for each name, with its natural frequency, at the force that its last number in newtons says."""
    for name, frequency in natural.items():
        level = float(re.findall(r"([\d.]+)N", name)[-1])
        values = level * receptance(FREQUENCY, frequency)
        size = [level + 0 * FREQUENCY] if force else []
        header = HEADER if force else HEADER.replace("Force [N],", "")
        columns = [FREQUENCY, *size, 1e6 * np.abs(values), np.degrees(np.angle(values))]
        write_csv(folder / f"{name}.csv", header, *columns)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("with_damper", "without_damper"), ("mit_Daempfer", "ohne_Daempfer"), ("bladeA", "bladeB"),
        ("torque5Nm", "torque12Nm"), ("preload_10N_level", "preload_20N_level"), ("new 20C", "new 80C"),
    ],
)  # fmt: skip
def test_other_words_of_names_are_other_tests(tmp_path: Path, first: str, second: str) -> None:
    write_sweeps(tmp_path, {f"{name}_{n}N": 100.0 for name in (first, second) for n in (1, 3)}, force=False)
    campaign, manifest = drafted(tmp_path)
    assert len(manifest["test"]) == 2
    assert [run["level"] for run in manifest["run"]] == [1.0, 3.0, 1.0, 3.0]
    assert not any("repeat" in run for run in manifest["run"])
    assert any("only by words in the names" in sentence for sentence in campaign.suspicions)


def test_a_quantity_in_the_names_of_columns_that_is_no_level_tells_tests(tmp_path: Path) -> None:
    size = 1e6 * np.abs(receptance(FREQUENCY))
    header = "f [Hz],Force 1000rpm [N],Disp 1000rpm [um],Force 2000rpm [N],Disp 2000rpm [um]"
    write_csv(tmp_path / "tip.csv", header, FREQUENCY, 1 + 0 * FREQUENCY, size, 1 + 0 * FREQUENCY, size)
    campaign, manifest = drafted(tmp_path)
    assert [run["test"] for run in manifest["run"]] == ["1000rpm", "2000rpm"]
    assert any("only by words in the names" in sentence for sentence in campaign.suspicions)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("sine_rep1_3N", "sine_rep2_3N"), ("sine_3N_1", "sine_3N_2"), ("run_a_3N", "run_b_3N"),
        ("before_3N", "after_3N"),
        ("sine_3N_20240312T1011", "sine_3N_20240313T0912"), ("1st_3N", "2nd_3N"), ("blade1_3N", "blade2_3N"),
    ],
)  # fmt: skip
def test_what_numbers_or_dates_a_run_is_no_test(tmp_path: Path, first: str, second: str) -> None:
    write_sweeps(tmp_path, {first: 100.0, second: 100.2})
    campaign, manifest = drafted(tmp_path)
    assert len(manifest["test"]) == 1
    assert [run["repeat"] for run in manifest["run"]] == [1, 2]
    assert not campaign.suspicions


def test_names_that_differ_in_the_encoding_of_an_accent_are_of_one_test(tmp_path: Path) -> None:
    names = {unicodedata.normalize(form, f"mit_Dämpfer_{level}N"): 100.0 for form, level in (("NFC", 1), ("NFD", 3))}
    write_sweeps(tmp_path, names)
    campaign, manifest = drafted(tmp_path)
    assert [test["name"] for test in manifest["test"]] == ["mit_Dämpfer"]
    assert not campaign.suspicions


def test_repeats_whose_peaks_are_apart_are_suspected(tmp_path: Path) -> None:
    write_sweeps(tmp_path, {"blade1_3N": 97.0, "blade2_3N": 102.0})
    campaign, _ = drafted(tmp_path)
    (sentence,) = [one for one in campaign.suspicions if "apart" in one]
    assert "4.9 %" in sentence
    assert "blade1_3N.csv" in sentence


def test_a_specimen_without_contacts_stays_free(tmp_path: Path) -> None:
    write_sweeps(tmp_path, {f"{name}_free_3N": 100.0 for name in ("bladeA", "bladeB")})
    _, manifest = drafted(tmp_path)
    assert {test["name"]: test["configuration"] for test in manifest["test"]} == {
        "bladeA_free": "free", "bladeB_free": "free",
    }  # fmt: skip


@pytest.mark.parametrize("name", ["{}_3N", "acc_{}_3N"])
def test_a_file_for_each_sensor_is_a_sensor_of_one_test(tmp_path: Path, name: str) -> None:
    write_sweeps(tmp_path, {name.format(place): 100.0 for place in ("tip", "mid", "sensor3")})
    _, manifest = drafted(tmp_path)
    assert len(manifest["test"]) == 1
    sensors = [sensor["name"].split() for sensor in manifest["sensor"]]
    assert [" ".join(words[:-1]) for words in sorted(sensors)] == ["mid", "sensor 3", "tip"]
    assert not any("repeat" in run for run in manifest["run"])


@pytest.mark.parametrize(
    ("name", "unit", "level"),
    [
        ("sweep_500mN", "N", 0.5), ("sweep_50%", "%", 50.0), ("sweep_0.5g", "g_n", 0.5), ("sine_2ms2", "m/s^2", 2.0),
        ("sweep_0.1Vrms", "V", 0.1),
    ],
)  # fmt: skip
def test_a_level_in_a_name_has_its_unit(tmp_path: Path, name: str, unit: str, level: float) -> None:
    values = receptance(FREQUENCY)
    write_csv(
        tmp_path / f"{name}.csv", "f [Hz],Acc [m/s^2],Phase [deg]", FREQUENCY, abs(values), np.angle(values, True)
    )
    _, manifest = drafted(tmp_path)
    assert manifest["units"]["level"] == unit
    assert manifest["run"][0]["level"] == pytest.approx(level)


def test_the_level_is_the_one_that_a_word_calls_so() -> None:
    def levels(name: str) -> list[str]:
        return [match[0] for match in find_levels_in_name(name)]

    assert levels("preload_10N_level_1N") == levels("level_1N_preload_10N") == ["1N"]
    assert levels("3N_sweep_1N")[0] == "1N"
    assert levels("preload_10N") == []
    assert list_condition_words("preload_10N_level_1N_80.5Hz_rep2_up") == ["preload", "10N"]


def test_the_width_of_a_peak_is_that_of_half_power() -> None:
    frequency = np.linspace(90, 110, 2001)
    (result,) = read_peaks(frequency[::-1], np.abs(receptance(frequency, 100.0, 0.01))[::-1])
    # Three steps: the peak and both ends lie on points.
    np.testing.assert_allclose([result.peak.frequency, result.width], [100.0, 2.0], atol=0.03)
    assert read_peaks(frequency, frequency) == ()


@pytest.mark.parametrize(("moved", "suspected"), [(1.0, None), (1.04, 0.04)])
def test_repeats_that_differ_in_which_of_two_modes_is_the_highest_are_alike(
    tmp_path: Path, moved: float, suspected: float | None
) -> None:
    sizes = {}
    for name, share, factor in (("rep1_3N", 0.8, 1.0), ("rep2_3N", 1.6, moved)):
        values = receptance(FREQUENCY, 94.0 * factor, 0.005) + share * receptance(FREQUENCY, 104.0 * factor, 0.005)
        sizes[name] = 1e6 * np.abs(values)
        columns = [FREQUENCY, 3 + 0 * FREQUENCY, 3 * sizes[name], np.degrees(np.angle(values))]
        write_csv(tmp_path / f"{name}.csv", HEADER, *columns)
    first, second = (read_peaks(FREQUENCY, size) for size in sizes.values())
    assert first[0].peak.frequency < 98 < second[0].peak.frequency  # each has another mode as its highest
    # Half a step of the frequencies for either peak.
    assert compare_peaks(first, second) == (None if suspected is None else pytest.approx(suspected, abs=0.006))
    campaign, _ = drafted(tmp_path)
    assert any("apart" in sentence for sentence in campaign.suspicions) == bool(suspected)


def test_a_mode_that_one_response_alone_shows_is_no_partner_of_an_octave_higher_one() -> None:
    frequency = np.linspace(10, 300, 2901)
    low, high = (read_peaks(frequency, np.abs(receptance(frequency, natural))) for natural in (100.0, 250.0))
    assert compare_peaks(low, high) == pytest.approx(0.6, abs=0.002)  # steps of 0.1 Hz
