"""LabVIEW measurement files: one or many columns of X, or none, and what is wrong in them."""

from pathlib import Path

import numpy as np
import pytest

from correlation.errors import CampaignError
from correlation.file.column import MeasuredFile
from correlation.file.read_file import read_file

HEAD = """LabVIEW Measurement\t
Writer_Version\t2
Separator\tTab
Decimal_Separator\t.
X_Columns\tOne
Operator\tlab
***End_of_Header***\t
\t
"""
SEGMENT = """Channels\t2\t\t\t
Samples\t3\t3\t\t
Y_Unit_Label\tm/s^2\tg\t\t
X_Dimension\tTime\tTime\t\t
X0\t1.0E+0\t1.0E+0\t\t
Delta_X\t5.0E-1\t5.0E-1\t\t
***End_of_Header***\t\t\t\t
X_Value\tAcc tip\tAcc mid\tComment
"""
ROWS = "1.0\t0.5\t-2.5\t\n1.5\t1.5\t3.5\tnote\n2.0\t2.5\t4.5\n"


def read(tmp_path: Path, text: str) -> MeasuredFile:
    (tmp_path / "decay.lvm").write_text(text)
    return read_file(tmp_path / "decay.lvm")


@pytest.mark.parametrize("crop", [0, 3])
def test_channels_have_their_units_and_the_time_that_is_written_or_stated(tmp_path: Path, crop: int) -> None:
    rows = "".join(f"{line[crop:]}\n" for line in ROWS.splitlines())  # LabVIEW leaves X empty if there is none
    measured = read(tmp_path, HEAD + SEGMENT + rows)
    assert measured.format == "lvm"
    assert measured.facts["Operator"] == "lab"
    assert [(one.name, one.unit, one.abscissa) for one in measured.columns] == [
        ("time", "s", None), ("Acc tip", "m/s^2", "time"), ("Acc mid", "g_n", "time"),
    ]  # fmt: skip
    np.testing.assert_array_equal(
        [one.values for one in measured.columns], [[1.0, 1.5, 2.0], [0.5, 1.5, 2.5], [-2.5, 3.5, 4.5]]
    )


def test_decimal_commas_and_a_time_for_each_channel_are_read(tmp_path: Path) -> None:
    text = (HEAD + SEGMENT).replace("Decimal_Separator\t.", "Decimal_Separator\t,").replace("One", "Multi")
    text = text.replace("X_Value\tAcc tip\tAcc mid", "X_Value\tAcc tip\tX_Value\tAcc mid")
    measured = read(tmp_path, text + "0,0\t1,5\t0,1\t2,5\n1,0\t3,5\t1,1\t4,5\n")
    assert [(one.name, one.abscissa) for one in measured.columns] == [
        ("time", None), ("Acc tip", "time"), ("time (2)", None), ("Acc mid", "time (2)"),
    ]  # fmt: skip
    np.testing.assert_array_equal(measured.column("Acc mid").values, [2.5, 4.5])


def test_each_channel_has_what_the_header_says_above_it(tmp_path: Path) -> None:
    """LabVIEW leaves the columns of X out in the header of a segment."""
    rows = [
        "Channels\t2\t\t\t", "Samples\t2\t\t2\t", "Y_Unit_Label\tN\t\tg\t", "X_Dimension\tTime\t\tFrequency\t",
        "X0\t1.0E+0\t\t2.0E+1\t", "Delta_X\t5.0E-1\t\t2.5E-1\t", "***End_of_Header***\t\t\t\t",
        "X_Value\tForce\tX_Value\tAcc\tComment", "\t1\t\t3\t", "\t2\t\t4\t",
    ]  # fmt: skip
    measured = read(tmp_path, HEAD.replace("One", "Multi") + "\n".join(rows) + "\n")
    assert [(one.name, one.unit, one.values.tolist()) for one in measured.columns] == [
        ("time", "s", [1.0, 1.5]), ("Force", "N", [1.0, 2.0]),
        ("frequency", "Hz", [20.0, 20.25]), ("Acc", "g_n", [3.0, 4.0]),
    ]  # fmt: skip


def test_segments_that_continue_are_one_and_others_are_groups(tmp_path: Path) -> None:
    later = SEGMENT + ROWS.replace("1.0\t0", "3.0\t0").replace("1.5\t1.5", "3.5\t1.5").replace("2.0\t", "4.0\t")
    measured = read(tmp_path, HEAD + SEGMENT + ROWS + "\n" + later)
    np.testing.assert_array_equal(measured.columns[0].values, [1.0, 1.5, 2.0, 3.0, 3.5, 4.0])
    for other, name in ((SEGMENT + ROWS, "Acc mid"), (later.replace("Acc mid", "Acc root"), "Acc root")):
        measured = read(tmp_path, HEAD + SEGMENT + ROWS + "\n" + other)
        groups = [one.name.partition("/")[0] for one in measured.columns]
        assert groups == ["segment 1"] * 3 + ["segment 2"] * 3
        column = measured.column(f"segment 2/{name}")
        assert (column.abscissa, column.values.tolist()) == ("segment 2/time", [-2.5, 3.5, 4.5])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HEAD, "no rows below a second"),
        (HEAD + SEGMENT, "line 15: has no rows below this header"),
        (HEAD + SEGMENT + "1.0\t0.5\n", "line 17: has 2 fields, other rows have 3"),
        (HEAD + SEGMENT + "1.0\tx\t0.5\n", 'line 17: "x" is not a number'),
    ],
)
def test_damage_is_one_sentence_with_its_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(CampaignError, match=message):
        read(tmp_path, text)


def test_a_plain_table_may_have_the_suffix(tmp_path: Path) -> None:
    np.testing.assert_array_equal(read(tmp_path, "a\tb\n1\t2\n3\t4\n").columns[1].values, [2.0, 4.0])
