"""Tables of text: separators, decimal signs, headers, units, words, and what is wrong in them."""

import gzip
import itertools
from pathlib import Path

import numpy as np
import pytest

from correlation.errors import CampaignError
from correlation.file.column import MeasuredFile
from correlation.file.read_file import read_file
from correlation.file.text_table.read_table import DECIMALS
from correlation.file.unit_label import split_label

X = np.array([0.5, -1.25, 3e-7, 40.0, 0.0])
Y = np.array([1.0, 2.0, -3.5, 1e4, 6.25])


def read(tmp_path: Path, text: str | bytes, name: str = "table.csv") -> MeasuredFile:
    path = tmp_path / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return read_file(path)


@pytest.mark.parametrize(
    ("separator", "decimal", "end"),
    [
        case
        for case in itertools.product([",", ";", "\t", " ", "|", ", "], ".,", ["\n", "\r\n"])
        if case[0][0] != case[1]
    ],
)
def test_any_separator_and_decimal_sign_comes_back(tmp_path: Path, separator: str, decimal: str, end: str) -> None:
    rows = [separator.join(repr(float(one)) for one in pair).replace(".", decimal) for pair in zip(X, Y, strict=True)]
    if separator[0] == "," and decimal == ".":
        rows = [separator.join(repr(float(one)) for one in pair) for pair in zip(X, Y, strict=True)]
    measured = read(tmp_path, end.join([separator.join(["time", "acc"]), *rows]) + end)
    assert [column.name for column in measured.columns] == ["time", "acc"]
    np.testing.assert_array_equal(measured.columns[0].values, X)
    np.testing.assert_array_equal(measured.columns[1].values, Y)


def test_decimal_commas_between_commas_are_read_in_quotation_marks_or_pairs(tmp_path: Path) -> None:
    quoted = read(tmp_path, 'a,b\n"1,5","2,25"\n"-3,0","4"\n')
    np.testing.assert_array_equal([column.values for column in quoted.columns], [[1.5, -3.0], [2.25, 4.0]])
    pairs = read(tmp_path, "a,b\n1,5,2,25\n-3,0,4,125\n")
    np.testing.assert_array_equal([column.values for column in pairs.columns], [[1.5, -3.0], [2.25, 4.125]])
    assert pairs.facts["decimal sign"] == "comma"
    with pytest.raises(
        CampaignError, match=r"line 1: has 2 fields .* the rows below have 4; are its decimals commas\?"
    ):
        read(tmp_path, "a,b\n1,5,2,25\n-3,0,4\n1,5,2,5\n1,5,2,5\n")


@pytest.mark.parametrize(
    ("rows", "values"),
    [
        (["70,5;31.454", "71,5;987", "72,5;1.005"], [31454.0, 987.0, 1005.0]),
        (["70,5;1.234,5", "71,5;12,25", "72,5;1.005.000"], [1234.5, 12.25, 1005000.0]),
        (["70,5;1 234,5", "71,5;12,25", "72,5;1\u202f005,5"], [1234.5, 12.25, 1005.5]),
        (['70.5;"1,234.5"', "71.5;12.25", "72.5;-1,005"], [1234.5, 12.25, -1005.0]),
        (["70.5;1'234.5", "71.5;12.25", "72.5;1005"], [1234.5, 12.25, 1005.0]),
        (["70;1,005", "71;987", "72;12,345"], [1005.0, 987.0, 12345.0]),
        (["70;1.005", "71;987", "72;12.345"], [1005.0, 987.0, 12345.0]),
        (["70;1,005", "71;0,987", "72;12,345"], [1.005, 0.987, 12.345]),
        (["70;1.005", "71;0.987", "72;12.345"], [1.005, 0.987, 12.345]),
        (["70;1.005", "71;2.987", "72;12.345"], [1.005, 2.987, 12.345]),
    ],
)
def test_groups_of_three_digits_are_thousands_and_other_signs_decimals(
    tmp_path: Path, rows: list[str], values: list[float]
) -> None:
    measured = read(tmp_path, "\n".join(["f;acc", *rows, *rows, *rows]) + "\n")
    np.testing.assert_array_equal(measured.columns[1].values[:3], values)


@pytest.mark.parametrize(
    ("rows", "doubtful"),
    [
        (["70.000;10.000;171", "70.500;9.998;168", "71.000;10.001;161"], True),
        (["70,000;10,000;171", "70,500;9,998;168", "71,000;10,001;161"], True),
        (["70.000;10.000;171", "70.500;9.998;168", "71.000;0.998;161"], False),  # no group begins with a zero
        (["70.000;10.000;171", "70.500;9.998;168", "71.00;10.001;161"], False),
        (["1;70.000;10.000", "2;70.500;9.998", "3;71.000;10.001"], False),  # the number of the row
        (["70.000;10.000;171.000", "70.500;9.998;168.250", "71.000;10.001;161.125"], False),
    ],
)
def test_numbers_that_may_be_decimals_or_thousands_are_doubted(tmp_path: Path, rows: list[str], doubtful: bool) -> None:
    measured = read(tmp_path, "\n".join(["f;force;phase", *rows]) + "\n")
    assert (DECIMALS in measured.facts) == doubtful


@pytest.mark.parametrize(
    ("header", "names", "units"),
    [
        ("time [s],acc [m/s^2]", ["time [s]", "acc [m/s^2]"], ["s", "m/s^2"]),
        ("Time (s),Acc (g)", ["Time (s)", "Acc (g)"], ["s", "g_n"]),
        ("t (sec),v (mm/s)", ["t (sec)", "v (mm/s)"], ["s", "mm/s"]),
        ("f,H ((m/s2)/N)", ["f", "H ((m/s2)/N)"], ["", "m/s^2/N"]),
        ("t,mass (g)", ["t", "mass (g)"], ["", "g"]),
        ("t,phase (°)", ["t", "phase (°)"], ["", "deg"]),
        ("omega [rad/s],phase [deg]", ["omega [rad/s]", "phase [deg]"], ["rad/s", "deg"]),
        ("t,acc (tip)", ["t", "acc (tip)"], ["", ""]),
        ("time,force\ns,N", ["time", "force"], ["s", "N"]),
        ("time,force\n[ms],[kN]", ["time", "force"], ["ms", "kN"]),
        ("Channel 1,Channel 2\ntime,acc\ns,m/s²", ["Channel 1 time", "Channel 2 acc"], ["s", "m/s^2"]),
        ("acc,acc", ["acc", "acc (2)"], ["", ""]),
        ("f,H\n\nUnits:\nHz,m/N", ["f", "H"], ["Hz", "m/N"]),  # of an analyser, with blank lines
        ("Signals,4\n,\n',Signal 2\n',g", ["column 1", "Signal 2"], ["", "g_n"]),  # a spreadsheet's empty line
        ("AxisUnit,Hz\n,\n',Signal 2\n',g", ["column 1", "Signal 2"], ["Hz", "g_n"]),
        ("time,", ["time", "column 2"], ["", ""]),
        ("# time, force", ["time", "force"], ["", ""]),
    ],
)
def test_names_and_units_come_from_the_header(tmp_path: Path, header: str, names: list[str], units: list[str]) -> None:
    measured = read(tmp_path, header + "\n0.5,1\n0.75,2\n1.0,3\n")
    assert [column.name for column in measured.columns] == names
    units_read = [column.unit for column in measured.columns]
    assert [unit.replace("(m/s^2)/N", "m/s^2/N") for unit in units_read] == units
    np.testing.assert_array_equal(measured.columns[1].values, [1.0, 2.0, 3.0])


@pytest.mark.parametrize(
    ("above", "names"),
    [
        (",tip,,root,", ["f", "tip Re", "tip Im", "root Re", "root Im"]),
        ("Point,tip,,root,", ["Point f", "tip Re", "tip Im", "root Re", "root Im"]),
        ("Operator,Smith,,,", ["Operator f", "Smith Re", "Im", "Re", "Im (2)"]),  # one cell spans nothing
        (",tip,,,root", ["f", "tip Re", "Im", "Re", "root Im"]),  # its columns differ
    ],
)
def test_a_cell_above_several_columns_is_in_the_names_of_all(tmp_path: Path, above: str, names: list[str]) -> None:
    measured = read(tmp_path, f"{above}\nf,Re,Im,Re,Im\n1,2,3,4,5\n6,7,8,9,10\n")
    assert [column.name for column in measured.columns] == names


@pytest.mark.parametrize(
    ("header", "unit", "reference"),
    [
        ("f (Hz),tip (dB re 1 m/N)", "m/N", 1.0), ("f,tip_dB", "", 1.0), ("f,tip [dB rel. 1e-6 m/s^2]", "m/s^2", 1e-6),
        ("f (Hz),tip [dB(mm/N)]", "mm/N", 1.0), ("f,tip\nHz,dB", "", 1.0), ("f,tip\nHz,dB re 2 um", "um", 2.0),
        ("f,tip dB (re. 1 m)", "m", 1.0), ("f,tip [dB (m/s^2)/N]", "(m/s^2)/N", 1.0),
    ],
)  # fmt: skip
def test_decibels_are_read_as_amplitudes(tmp_path: Path, header: str, unit: str, reference: float) -> None:
    _, tip = read(tmp_path, header + "\n1,-40\n2,0\n3,6.0206\n").columns
    np.testing.assert_allclose(tip.values, reference * np.array([0.01, 1.0, 2.0]), rtol=1e-6)  # 20 lg 2 = 6.0206
    assert tip.unit == unit


def test_decibels_of_a_power_and_volts_called_dbv_stay(tmp_path: Path) -> None:
    for name in ("PSD (dB)", "power dB re 1 m^2", "noise (dBV)"):
        np.testing.assert_array_equal(read(tmp_path, f"f,{name}\n1,-40\n2,0\n").columns[1].values, [-40.0, 0.0])


@pytest.mark.parametrize("above", ["", "# Sample rate: 4000 Hz\n", "Sample rate: 4000 Hz\n"])
@pytest.mark.parametrize("header", ["Acc tip [m/s^2]", "Acc tip\nm/s^2", "Acc tip (m/s²)"])
def test_the_name_of_a_single_column_may_have_blanks(tmp_path: Path, above: str, header: str) -> None:
    measured = read(tmp_path, f"{above}{header}\n0.5\n1.5\n-2.5\n")
    (column,) = measured.columns
    assert (split_label(column.name)[0], column.unit) == ("Acc tip", "m/s^2")
    np.testing.assert_array_equal(column.values, [0.5, 1.5, -2.5])
    assert measured.facts.get("sample rate", "") == ("4000 Hz" if above else "")


@pytest.mark.parametrize("closing", ["End of data", ";\nMean;2,5\nMax;3,5", "*** End ***\n", '"Mittelwert";2'])
def test_rows_that_close_a_table_are_not_read_and_named(tmp_path: Path, closing: str) -> None:
    measured = read(tmp_path, "f;acc\n" + 4 * "1,5;2\n2,5;3\n" + closing + "\n")
    np.testing.assert_array_equal([column.values for column in measured.columns], [4 * [1.5, 2.5], 4 * [2.0, 3.0]])
    assert "not part of the table" in measured.facts["closing rows"]
    assert closing.strip(";\n").splitlines()[0] in measured.facts["closing rows"]


def test_two_tables_in_one_file_are_refused_with_the_line_between_them(tmp_path: Path) -> None:
    block = "\n".join(f"{f};{f + 1}" for f in range(5))
    with pytest.raises(CampaignError, match=r'line 8: "Sweep at 3 N" ends a table, and line 10 .* its own file'):
        read(tmp_path, f"Sweep at 1 N\nf;acc\n{block}\nSweep at 3 N\nf;acc\n{block}\n")


def test_a_column_is_found_without_its_unit_and_a_misspelt_one_is_corrected(tmp_path: Path) -> None:
    measured = read(tmp_path, "time [s],acc [g],acc [m/s^2]\n0,1,2\n1,2,3\n")
    assert measured.column("time").name == "time [s]"
    with pytest.raises(CampaignError, match=r'may be "acc \[g\]", "acc \[m/s\^2\]"'):
        measured.column("acc")
    with pytest.raises(CampaignError, match=r'has no column "tme \[s\]"; did you mean "time \[s\]"'):
        measured.column("tme [s]")


def test_preamble_and_comments_become_facts(tmp_path: Path) -> None:
    text = "Title;beam 3\nOperator: X. Y.\n\n% rate: 1000 Hz\nt;x\n0;1\n1;2\n# end\n2;3\n"
    measured = read(tmp_path, text)
    assert measured.title == "beam 3"
    assert measured.facts["operator"] == "X. Y."
    assert measured.facts["rate"] == "1000 Hz"
    np.testing.assert_array_equal(measured.column("x").values, [1, 2, 3])


def test_rows_without_a_header_get_numbers_as_names(tmp_path: Path) -> None:
    measured = read(tmp_path, "1 2\n3 4\n", "table.dat")
    assert [column.name for column in measured.columns] == ["column 1", "column 2"]
    np.testing.assert_array_equal(measured.columns[0].values, [1, 3])


def test_words_are_indices(tmp_path: Path) -> None:
    measured = read(tmp_path, "sweep,x\nup,1\nup,2\ndown,3\n")
    assert measured.column("sweep").words == ("up", "down")
    np.testing.assert_array_equal(measured.column("sweep").values, [0, 0, 1])


def test_empty_fields_are_not_measured_and_a_closing_separator_is_no_column(tmp_path: Path) -> None:
    measured = read(tmp_path, '"V1","V2",\n1,2,\n3,,\nNaN,4,\n')
    np.testing.assert_array_equal(measured.column("V1").values, [1, 3, np.nan])
    np.testing.assert_array_equal(measured.column("V2").values, [2, np.nan, 4])
    assert len(measured.columns) == 2


def test_complex_numbers_and_exponents_of_fortran_are_read(tmp_path: Path) -> None:
    measured = read(tmp_path, "a,b\n1D-3,1+2i\n2d+2,-1.5e1-2j\n")
    np.testing.assert_array_equal(measured.column("a").values, [1e-3, 200.0])
    np.testing.assert_array_equal(measured.column("b").values, [1 + 2j, -15 - 2j])


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_encodings_and_gzip_do_not_matter(tmp_path: Path, encoding: str) -> None:
    text = "t [µs],a [m/s²]\n1,2\n3,4\n".encode(encoding)
    for name, data in (("a.csv", text), ("a.csv.gz", gzip.compress(text))):
        measured = read(tmp_path, data, name)
        assert [column.unit for column in measured.columns] == ["µs", "m/s^2"]
        np.testing.assert_array_equal(measured.columns[1].values, [2, 4])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a,b\n1,2\n3\n4,5\n6,7\n", r"line 3: has 1 fields, other rows have 2: is the row cut short\?"),
        ("a,b\n1,2\n3,x4\n5,6\n7,8\n", 'line 3, column 2: "x4" is not a number'),
        ("a,b\n1,2\n3,1_000\n5,6\n7,8\n9,9\n", 'line 3, column 2: "1_000" is not a number'),
        ("a;b\n1,5;2\n2,5;3\n1.5;3\n2,5;1\n2,5;2\n1.234,5;1\n", 'line 4, column 1: "1.5" has a point .* no groups'),
        ("a;b\n1,5;2\n2,5;3\n1.23.5;3\n2,5;1\n2,5;2\n", 'line 4, column 1: "1.23.5" is not a number'),
        ("a\tb\n1.5\t2\n2.5\t3\n1,25\t3\n2.5\t1\n2.5\t2\n", 'line 4, column 1: "1,25" has a comma .* no groups'),
        ("a;b\n1,5;70.5\n2,5;71.5\n3,5;72.5\n", "has a comma where decimals are points"),
        ("a;b\n1,5;0.125\n2,5;0.250\n3,5;0.375\n", "has a comma where decimals are points"),
        ("a,b\n1,2\n3,4\nx5,6\n7,8\n9,9\n", 'line 4, column 1: "x5" is not a number'),
        ("a,b\n0.0x5,1\n2,3\n4,5\n6,7\n", r'line 2: "0\.0x5" is not a number'),
        ("a,b,c\n1,2\n3,4\n", "line 1: has 3 fields between commas, the rows below have 2"),
        ('a,b\n1,2\n"3,4\n5,6\n', "line 3: a quotation mark"),
        ("a,b\nx,y\n", "no column of numbers"),
        ("\n\n", "no rows"),
        ("a,b\n1,\0\n2,3\n", "line 2: is not text"),
    ],
)
def test_damage_is_one_sentence_with_line_and_value(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(CampaignError, match=message) as error:
        read(tmp_path, text)
    assert str(error.value).startswith("table.csv")
    assert "\n" not in str(error.value)


def test_a_cut_gzip_file_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match="compressed content is damaged"):
        read(tmp_path, gzip.compress(b"a,b\n1,2\n")[:-6], "a.csv.gz")


def test_numbers_beyond_the_first_block_come_in_order(tmp_path: Path) -> None:
    count = 45_000  # more than two blocks of 20,000 rows
    rows = [f"{number};{'up' if number < 30_000 else 'down'};{number / 8:.3f}" for number in range(count)]
    measured = read(tmp_path, "\n".join(["n;sweep;x", *rows]).replace(".", ","))
    np.testing.assert_array_equal(measured.column("n").values, np.arange(count))
    np.testing.assert_array_equal(measured.column("x").values, np.arange(count) / 8)
    assert measured.column("sweep").words == ("up", "down")
    np.testing.assert_array_equal(measured.column("sweep").values, np.arange(count) >= 30_000)


def test_lines_that_a_spreadsheet_put_into_quotation_marks_are_rows(tmp_path: Path) -> None:
    rows = "".join(f'"{number / 8},{number}"\n' for number in range(5))
    measured = read(tmp_path, f'"Time (s),""Acc, tip (g)"""\n{rows}')
    assert [(column.name, column.unit) for column in measured.columns] == [("Time (s)", "s"), ("Acc, tip (g)", "g_n")]
    np.testing.assert_array_equal(measured.columns[0].values, np.arange(5) / 8)


def test_dates_with_times_are_seconds_from_the_first(tmp_path: Path) -> None:
    rows = ["2025-11-14 23:59:59.990,1", "2025-11-14T23:59:59.995,2", "2025-11-15 00:00:00,3"]
    measured = read(tmp_path, "\n".join(["Timestamp,x", *rows]))
    time = measured.columns[0]
    assert (time.unit, time.function, time.words) == ("s", "time", ())
    np.testing.assert_allclose(time.values, [0.0, 0.005, 0.01], atol=1e-9)
    assert time.facts["begins"] == "2025-11-14 23:59:59.990"


@pytest.mark.parametrize("words", [["2025-11-14 20:00", "2025-11-14 20:00", "2025-11-15 08:00"] * 3, ["a:b", "c:d"]])
def test_dates_of_few_runs_and_other_words_stay_words(tmp_path: Path, words: list[str]) -> None:
    measured = read(tmp_path, "\n".join(["run,x", *(f"{word},{row}" for row, word in enumerate(words))]))
    assert measured.columns[0].words
