"""Files of every format are recognised by content and suffix; what is none is one sentence."""

import os
from pathlib import Path

import numpy as np
import pytest

from correlation.errors import CampaignError
from correlation.file.format import MEASURED_FILES
from correlation.file.read_file import find_file_format, read_file
from correlation.file.unit_label import read_unit, split_label
from tests.correlation.file.uff_bytes import DOUBLE_COMPLEX, example

DATA = os.environ.get("STICKSLIP_DATA", "")
needs_data = pytest.mark.skipif(not Path(DATA, "brb_forced").is_dir(), reason="measured sets are not here")


def test_all_formats_are_found() -> None:
    assert MEASURED_FILES.names() == ["csv", "hdf5", "lvm", "matlab 5", "matlab 7.3", "tdms", "uff", "wav"]


def test_content_counts_before_the_suffix(tmp_path: Path) -> None:
    (tmp_path / "beam.txt").write_bytes(example(DOUBLE_COMPLEX, even=True).text())
    assert find_file_format(tmp_path / "beam.txt").name == "uff"
    (tmp_path / "beam.prn").write_text("a\tb\n1\t2\n3\t4\n")
    assert find_file_format(tmp_path / "beam.prn").name == "csv"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"PK\x03\x04\x01\x02", "save its sheets as CSV"),
        (b"\x00\x01\x02\x03", "is of no known format: give a table"),
    ],
)
def test_a_file_of_no_format_is_one_sentence(tmp_path: Path, content: bytes, message: str) -> None:
    (tmp_path / "some.thing").write_bytes(content)
    with pytest.raises(CampaignError, match=message):
        read_file(tmp_path / "some.thing")


def test_a_missing_file_and_a_folder_are_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match="there is no such file"):
        read_file(tmp_path / "nothing.csv")
    with pytest.raises(CampaignError, match="is a folder"):
        read_file(tmp_path)


@pytest.mark.parametrize(
    ("label", "unit"),
    [
        ("m/s²", "m/s^2"), ("m/s2", "m/s^2"), ("m/s**2", "m/s^2"), ("g", "g_n"), ("[um]", "um"), ("(N)", "N"),
        ("Volts", "V"), ("sec", "s"), ("°", "deg"), ("%", "percent"), ("lbs", "lbf"), ("EU", ""), ("none", ""),
        ("dB", ""), ("in/s", "inch/s"), ("g²/Hz", "g_n^2/Hz"), ("rad/s", "rad/s"), ("U/min", "rpm"), ("nonsense", ""),
    ],
)  # fmt: skip
def test_labels_of_units_become_units(label: str, unit: str) -> None:
    assert read_unit(label) == unit


def test_a_bracket_that_is_no_unit_stays_in_the_name() -> None:
    assert split_label("acc (left pad)") == ("acc (left pad)", "")
    assert split_label("acc [mm/s^2]") == ("acc", "mm/s^2")


def test_values_of_a_column_cannot_be_changed(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("a,b\n1,2\n3,4\n")
    with pytest.raises(ValueError, match="read-only"):
        read_file(tmp_path / "a.csv").columns[0].values[0] = 7.0


@needs_data
def test_measured_sets_are_read() -> None:
    forced = read_file(Path(DATA, "brb_forced", "ForcedFrequencyResponses.mat"))
    names = ("frequency", "force", "amplitude", "phase")
    units = [forced.column(f"FRdata.ForceControl(1).{name}").unit for name in names]
    assert units == ["Hz", "N", "m/s^2", "rad"]
    assert len(read_file(Path(DATA, "brb_forced", "HammerImpact.mat")).column("HIdata.acc3").values) == 65536
    voltage = read_file(Path(DATA, "silverbox", "SNLS80mV.csv"))
    assert [column.name for column in voltage.columns] == ["V1", "V2"]
    sound = read_file(Path(DATA, "uff_samples", "Sample_UFF58b_bin.uff")).columns
    # The file's own header: 79292 samples, 1.52588e-05 s apart, in Pa.
    assert (len(sound[1].values), sound[1].unit, sound[0].unit) == (79292, "Pa", "s")
    np.testing.assert_allclose(np.diff(sound[0].values[:3]), 1.52588e-5, rtol=1e-9)
    density = read_file(Path(DATA, "uff_samples", "sample_dataset58_psd.uff")).columns[1]
    assert (density.function, density.unit, len(density.values)) == ("power spectral density", "g_n^2/Hz", 3201)
