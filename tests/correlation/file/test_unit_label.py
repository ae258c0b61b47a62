"""Notations of units: what stands in, behind or above a name, and what it says of an amplitude."""

from pathlib import Path

import numpy as np
import pytest

from correlation.campaign.measurement_unit import find_root_units
from correlation.file.read_file import read_file
from correlation.file.unit_label import (
    find_amplitude_in_words,
    find_amplitude_of_unit,
    find_suffix,
    read_unit,
    split_label,
)


@pytest.mark.parametrize(
    ("label", "same"),
    [
        ("μm", "um"), ("µm", "um"), ("μm/N", "um/N"), ("Mikrometer", "um"), ("Millimetern", "mm"), ("Sekunden", "s"),
        ("Kilonewton", "kN"), ("mils", "thou"), ("mil", "thou"), ("m·s⁻²", "m/s^2"), ("m s^-2", "m/s^2"),
        ("m.s-2", "m/s^2"), ("ms-2", "m/s^2"), ("1/kg", "(m/s^2)/N"), ("m/Ns", "(m/s)/N"), ("MM", "mm"), ("mHz", "mHz"),
        ("Grad", "deg"), ("mm pp", "mm"), ("g rms / N rms", "g_n/N"), ("cm/s", "cm/s"),
    ],
)  # fmt: skip
def test_notations_of_a_unit_mean_the_same(label: str, same: str) -> None:
    assert find_root_units(read_unit(label)) == find_root_units(same)


@pytest.mark.parametrize(
    "label", ["furlong", "nonsense", "acc", "tip", "step", "/N", "mm/furlong", "mm pp / N", "rms", "1", "EU"]
)
def test_what_is_no_unit_of_test_benches_names_none(label: str) -> None:
    assert read_unit(label) == ""


@pytest.mark.parametrize(
    ("label", "name", "unit"),
    [
        ("Weg / µm", "Weg", "µm"), ("Kraft/N", "Kraft", "N"), ("Phase / °", "Phase", "deg"), ("tip / µm", "tip", "µm"),
        ("Amplitude / (m/s²)/N", "Amplitude", "(m/s^2)/N"), ("Log/Weg / µm", "Log/Weg", "µm"),
        ("Weg in µm", "Weg", "µm"), ("Zeit in ms", "Zeit", "ms"), ("Displacement, um", "Displacement", "um"),
        ("Disp um", "Disp", "um"), ("Force N", "Force", "N"), ("Force N rms", "Force", "N"), ("tip mm", "tip", "mm"),
        ("Disp [mm-pp]", "Disp", "mm"), ("Acc [g] RMS", "Acc", "g_n"), ("Disp (mm) (p-p)", "Disp", "mm"),
        ("H [m/N] Real", "H Real", "m/N"), ("H (m/s^2)/N", "H", "(m/s^2)/N"),
        ("Amp (um) 3N", "Amp 3N", "um"), ("Disp [mm] (tip)", "Disp (tip)", "mm"),
    ],
)  # fmt: skip
def test_a_unit_stands_behind_a_name_in_many_ways(label: str, name: str, unit: str) -> None:
    assert split_label(label) == (name, unit)


@pytest.mark.parametrize(
    "label",
    [
        "acc / N", "force / m", "H/N", "tip/N", "acc/force", "run/acc", "drive/Force", "58 #2 1Z+/1Z+", "acc in z",
        "X in phase", "acc A", "acc G", "sensor K", "acc tip", "u, v", "Time, elapsed", "acc min", "1/s", "Peak",
        "signal in", "x (t) left",
    ],
)  # fmt: skip
def test_a_word_that_may_be_a_name_a_ratio_or_a_path_is_no_unit(label: str) -> None:
    assert split_label(label) == (label, "")


def test_units_at_the_end_of_names_are_found_with_what_the_amplitude_is() -> None:
    units = {
        "vel_tip_mms": "mm/s", "a_mm_s2": "mm/s^2", "x_mm_pp": "mm", "a_g_rms": "g_n", "t_ms": "ms", "acc_tip": "",
        "disp_cm": "cm", "Zeit_µs": "µs", "Acc_m/s²": "m/s^2", "disp_s": "s", "acc_min": "",
    }  # fmt: skip
    assert {name: find_suffix(name)[1] for name in units} == units


@pytest.mark.parametrize(
    ("label", "amplitude"),
    [
        ("mm pp", "peak to peak"), ("mm p-p", "peak to peak"), ("mm pk-pk", "peak to peak"), ("Vpp", "peak to peak"),
        ("mm rms", "rms"), ("grms", "rms"), ("m/s² RMS", "rms"), ("g (rms)", "rms"), ("mm pk", "peak"),
        ("mm 0-pk", "peak"), ("N", ""), ("g rms/N rms", ""),
    ],
)  # fmt: skip
def test_a_word_beside_a_unit_says_what_an_amplitude_is(label: str, amplitude: str) -> None:
    assert find_amplitude_of_unit(label) == amplitude


def test_words_of_a_text_say_what_an_amplitude_is() -> None:
    texts = ("Force RMS", "Spectrum (RMS)", "peak to peak", "acc_pk", "farms", "appears", "rms or peak")
    assert [find_amplitude_in_words(text) for text in texts] == ["rms", "rms", "peak to peak", "peak", "", "", ""]


@pytest.mark.parametrize(
    "header",
    ["Hz,N,μm\nFrequency,Force,Disp", "Frequency,Force,Disp\nHz,N,μm", "Frequency [Hz],Force (N),Disp [μm]"],
)
def test_a_row_of_units_stands_above_or_below_the_names(tmp_path: Path, header: str) -> None:
    (tmp_path / "a.csv").write_text(header + "\n1,2,3\n4,5,6\n7,8,9\n", encoding="utf-8")
    columns = read_file(tmp_path / "a.csv").columns
    assert [column.unit for column in columns] == ["Hz", "N", "µm"]
    assert [split_label(column.name)[0] for column in columns] == ["Frequency", "Force", "Disp"]


def test_a_unit_with_the_part_of_a_complex_number_names_both(tmp_path: Path) -> None:
    header = "Hz\t(m/s^2)/N Real\t(m/s^2)/N Imag"
    (tmp_path / "a.txt").write_text(header + "\n1\t2\t3\n4\t5\t6\n7\t8\t9\n")
    assert [column.unit for column in read_file(tmp_path / "a.txt").columns] == ["Hz", "(m/s^2)/N", "(m/s^2)/N"]


@pytest.mark.parametrize(
    ("label", "factor", "unit"),
    [("Acc [dBg]", 1.0, "g_n"), ("Acc [dB(1e-6 m/s²)]", 1e-6, "m/s^2"), ("Acc dB [re 1e-6 g]", 1e-6, "g_n")],
)
def test_the_reference_of_decibels_may_be_attached_or_in_brackets(
    tmp_path: Path, label: str, factor: float, unit: str
) -> None:
    (tmp_path / "a.csv").write_text(f"f,{label}\n1,-40\n2,0\n3,20\n", encoding="utf-8")
    acc = read_file(tmp_path / "a.csv").columns[1]
    np.testing.assert_allclose(acc.values, factor * np.array([0.01, 1.0, 10.0]))
    assert acc.unit == unit
