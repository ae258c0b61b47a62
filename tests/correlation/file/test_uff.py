"""Universal files: what is written byte by byte from the description, by pyuff and by us comes back exactly."""

import itertools
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from correlation.errors import CampaignError
from correlation.file.column import Column, MeasuredFile, Point
from correlation.file.format.uff import NOT_CLOSED
from correlation.file.read_file import read_file
from correlation.file.uff.dataset_58 import FUNCTIONS
from correlation.file.uff.write_uff import write_uff
from tests.correlation.file.uff_bytes import (
    DOUBLE_COMPLEX,
    DOUBLE_REAL,
    SINGLE_COMPLEX,
    SINGLE_REAL,
    Function,
    example,
    lines_to_bytes,
    nodes,
    units,
)

KINDS = (SINGLE_REAL, DOUBLE_REAL, SINGLE_COMPLEX, DOUBLE_COMPLEX)
CASES = [*itertools.product(KINDS, (True, False))]


def read(tmp_path: Path, data: bytes, name: str = "beam.uff") -> MeasuredFile:
    path = tmp_path / name
    path.write_bytes(data)
    return read_file(path)


def check(measured: MeasuredFile, function: Function) -> None:
    abscissa, column = measured.columns
    np.testing.assert_array_equal(abscissa.values, function.x)
    np.testing.assert_array_equal(column.values, function.y)
    assert np.iscomplexobj(column.values) == (function.kind in {SINGLE_COMPLEX, DOUBLE_COMPLEX})
    assert (abscissa.name, abscissa.unit, column.abscissa) == ("frequency", "Hz", "frequency")


@pytest.mark.parametrize(("kind", "even"), CASES)
def test_text_comes_back_exactly(tmp_path: Path, kind: int, even: bool) -> None:
    function = example(kind, even=even)
    check(read(tmp_path, function.text()), function)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(("kind", "even"), CASES)
def test_binary_values_come_back_exactly_in_both_byte_orders(tmp_path: Path, kind: int, even: bool, order: str) -> None:
    function = example(kind, even=even)
    check(read(tmp_path, function.binary(order)), function)


@pytest.mark.parametrize("kind", [DOUBLE_REAL, DOUBLE_COMPLEX])
def test_an_uneven_abscissa_may_have_single_precision_beside_double_values(tmp_path: Path, kind: int) -> None:
    function = example(kind, even=False)
    check(read(tmp_path, function.binary("<", single_abscissa=True)), function)


def pad(data: bytes) -> bytes:
    return b"".join(line.ljust(80) + b"\n" for line in data.splitlines())


def shorten(data: bytes) -> bytes:
    return b"".join(line.rstrip() + b"\n" for line in data.splitlines())


DIALECTS: dict[str, Callable[[bytes], bytes]] = {
    "lines of 80 characters": pad,
    "no blanks at line ends": shorten,
    "carriage returns": lambda data: data.replace(b"\n", b"\r\n"),
    "blank lines at the end": lambda data: data + b"\n  \n",
    "blank lines at the beginning": lambda data: b"\n" + data,
    "no last -1": lambda data: data[: data.rindex(b"    -1")],
    "no last line end": lambda data: data.rstrip(b"\n"),
    "control-Z at the end": lambda data: data + b"\x1a",
    "D exponents": lambda data: data.replace(b"E+", b"D+").replace(b"E-", b"D-"),
    "small letters": lambda data: data.replace(b"E+", b"e+").replace(b"E-", b"e-"),
}


@pytest.mark.parametrize("dialect", DIALECTS)
@pytest.mark.parametrize(("kind", "even"), CASES)
def test_dialects_of_text_come_back_exactly(tmp_path: Path, dialect: str, kind: int, even: bool) -> None:
    function = example(kind, even=even)
    check(read(tmp_path, DIALECTS[dialect](function.text())), function)


@pytest.mark.parametrize(("kind", "even"), CASES)
def test_numbers_without_blanks_between_them_come_back(tmp_path: Path, kind: int, even: bool) -> None:
    # Three-digit exponents fill the columns: 13 of -1.25000E+100, which FORTRAN shortens to -1.25000+100.
    function = example(kind, even=even)
    fused = Function(**{**vars(function), "y": np.where(np.arange(7) % 2, -1.25e100, -5.0e-101) * (1 + 0 * function.y)})
    data = fused.text()
    check(read(tmp_path, data), fused)
    shorter = re.sub(rb"(-?\d\.\d+)E([+-]\d{3})", rb" \1\2", data)
    check(read(tmp_path, shorter, "short.uff"), fused)


def test_a_last_line_that_is_filled_with_zeros_is_no_surplus(tmp_path: Path) -> None:
    function = example(SINGLE_COMPLEX, even=False)
    lines = function.text().splitlines()
    lines[-2] += b"  0.00000E+00" * 3
    check(read(tmp_path, b"\n".join(lines) + b"\n"), function)


@pytest.mark.parametrize("behind", [b"\n    -1\n", b"\r\n    -1\r\n", b"    -1", b"", b"    -1\n\n"])
def test_binary_values_may_be_followed_by_a_line_end_or_nothing(tmp_path: Path, behind: bytes) -> None:
    function = example(DOUBLE_COMPLEX, even=True)
    data = function.binary("<")
    check(read(tmp_path, data[: -len(b"    -1\n")] + behind), function)


def test_binary_values_may_contain_the_bytes_of_a_delimiter_and_line_ends(tmp_path: Path) -> None:
    text = b"xxxxxx\n    -1\n    -1\n    15\nyyyyyyyyyyyy"
    payload = text + bytes(-len(text) % 8)
    function = example(DOUBLE_REAL, even=True, count=len(payload) // 8)
    data = function.binary("<")
    start = len(data) - len(payload) - len(b"    -1\n")
    measured = read(tmp_path, data[:start] + payload + b"    -1\n" + data)
    np.testing.assert_array_equal(measured.columns[1].values, np.frombuffer(payload, "<f8"))
    np.testing.assert_array_equal(measured.columns[2].values, function.y)


def test_a_wrong_number_of_bytes_in_the_identifier_does_not_matter(tmp_path: Path) -> None:
    # Programs write 8 n for complex values.
    function = example(DOUBLE_COMPLEX, even=True)
    check(read(tmp_path, function.binary("<").replace(f"{16 * 7:12d}".encode(), f"{8 * 7:12d}".encode())), function)


def test_points_functions_and_units_are_those_of_the_header(tmp_path: Path) -> None:
    function = example(DOUBLE_COMPLEX, even=True)
    coherence = Function(**{**vars(example(SINGLE_REAL, even=True)), "function": 6, "response": ("tip", 7, -5)})
    other = Function(**{**vars(coherence), "x": coherence.x + 1.0})
    data = units(5, 1000.0, 1000.0) + function.text() + coherence.text() + other.text()
    measured = read(tmp_path, data)
    names = [column.name for column in measured.columns]
    assert names == ["frequency", "58 #2 12Z+/1Z-", "58 #3 7RY-/1Z-", "frequency (2)", "58 #4 7RY-/1Z-"]
    column = measured.column("58 #2 12Z+/1Z-")
    assert column.function == "frequency response"
    assert column.unit == "(mm/s^2)/(mN)"
    assert column.response is not None
    assert column.reference is not None
    assert (column.response.node, column.response.direction) == (12, "+z")
    assert (column.reference.node, column.reference.direction) == (1, "-z")
    assert column.facts["line 3"] == "18-Apr-16 13:49:58"
    assert column.where == "dataset 2, line 8"
    assert measured.columns[2].function == "coherence"
    assert measured.columns[4].abscissa == "frequency (2)"
    point = measured.columns[2].response
    assert point is not None
    assert (point.node, point.direction, point.name) == (7, "-ry", "tip")


@pytest.mark.parametrize(
    ("axes", "unit"),
    [
        (((18, "", "Hz"), (12, "acc", "g"), (13, "force", "N"), (0, "", "")), "(g_n)/(N)"),
        (((18, "", "Hz"), (12, "acc", "m/s^2/N"), (13, "force", "N"), (0, "", "")), "m/s^2/N"),
        (((18, "", "Hz"), (8, "NONE", "NONE"), (13, "NONE", "NONE"), (0, "", "")), "(m)/(N)"),
        (((18, "", "Hz"), (11, "v", "mm/s"), (0, "NONE", "NONE"), (0, "", "")), "mm/s"),
        (((18, "", "Hz"), (1, "NONE", "EU"), (0, "NONE", "NONE"), (0, "", "")), ""),
    ],
)
def test_labels_of_units_count_before_types(tmp_path: Path, axes: tuple[tuple[int, str, str], ...], unit: str) -> None:
    function = Function(**{**vars(example(DOUBLE_COMPLEX, even=True)), "axes": axes})
    assert read(tmp_path, units(1, 1.0, 1.0) + function.text()).columns[1].unit == unit


def test_without_units_and_labels_a_unit_is_unknown(tmp_path: Path) -> None:
    column = read(tmp_path, example(DOUBLE_COMPLEX, even=True).text()).columns[1]
    assert column.unit == ""
    assert (column.facts["quantity"], column.facts["per"]) == ("acceleration", "excitation force")


def test_nodes_come_in_metres_through_the_factor_of_length(tmp_path: Path) -> None:
    data = nodes([(3, 250.0, -1.0, 0.5), (12, 500.0, 0.0, 0.0)])
    measured = read(tmp_path, data + units(9, 1000.0, 1.0))
    np.testing.assert_allclose(measured.nodes[3], [0.25, -0.001, 0.0005], rtol=1e-15)
    assert sorted(measured.nodes) == [3, 12]
    place = "   2.5000000000000000D+02  -1.0000000000000000D+00   5.0000000000000000D-01"
    newer = lines_to_bytes(["    -1", "  2411", f"{3:10d}{1:10d}{1:10d}{11:10d}", place, "    -1"])
    np.testing.assert_array_equal(read(tmp_path, newer + units(9, 1000.0, 1.0)).nodes[3], measured.nodes[3])


def shape(analysis: int, kind: int, real: list[float], rows: list[tuple[int, list[float]]], width: int) -> bytes:
    lines = ["    -1", "    55", "NONE", "NONE", "NONE", "NONE", "NONE"]
    lines.append("".join(f"{one:10d}" for one in (1, analysis, 2, 8, kind, width)))
    lines.append("".join(f"{one:10d}" for one in (2, len(real), 1, 4)))
    lines.append("".join(f"{one:13.5E}" for one in real))
    for node, values in rows:
        lines.append(f"{node:10d}")
        lines += ["".join(f"{one:13.5E}" for one in values[start : start + 6]) for start in range(0, len(values), 6)]
    return lines_to_bytes([*lines, "    -1"])


def test_shapes_have_their_frequency_damping_and_values(tmp_path: Path) -> None:
    real = shape(2, 2, [122.5, 1.0, 0.015, 0.0], [(1, [0.5, 0.0, -1.0]), (4, [0.25, 0.125, 2.0])], 3)
    # lambda = -3 + 4i: |lambda| = 5 rad/s, damping ratio 0.6.
    mode = shape(3, 5, [-3.0, 4.0, 0, 0, 0, 0], [(1, [float(one) for one in range(1, 13)])], 6)
    first, second = read(tmp_path, units(1, 1.0, 1.0) + real + mode).shapes
    assert (first.kind, first.frequency, first.damping_ratio, first.unit) == ("normal mode", 122.5, 0.015, "m")
    np.testing.assert_array_equal(first.nodes, [1, 4])
    np.testing.assert_array_equal(first.values, [[0.5, 0.0, -1.0], [0.25, 0.125, 2.0]])
    assert second.kind == "complex mode"
    np.testing.assert_allclose([second.frequency, second.damping_ratio], [5 / (2 * np.pi), 0.6], rtol=1e-15)
    np.testing.assert_array_equal(second.values, [[1 + 2j, 3 + 4j, 5 + 6j, 7 + 8j, 9 + 10j, 11 + 12j]])


def test_numbers_of_a_shape_may_fill_their_fields(tmp_path: Path) -> None:
    digits = [-3.123456, -4.123456, -1.123456, -2.123456, -5.123456, -6.123456]  # 13 characters with six decimals
    data = shape(3, 5, digits, [(1, digits)], 3)
    for number in digits:
        data = data.replace(f"{number:13.5E}".encode(), f"{number:13.6E}".encode())
    assert b"-3.123456E+00-4.123456E+00" in data
    (mode,) = read(tmp_path, units(1, 1.0, 1.0) + data).shapes
    assert mode.frequency == pytest.approx(np.hypot(*digits[:2]) / (2 * np.pi), rel=1e-12)
    np.testing.assert_array_equal(mode.values, [[complex(*digits[:2]), complex(*digits[2:4]), complex(*digits[4:])]])


def test_other_datasets_are_passed_over_and_named(tmp_path: Path) -> None:
    function = example(DOUBLE_REAL, even=True)
    other = lines_to_bytes(["    -1", "    82", "         1         2         3", "trace", "    -1"])
    title = lines_to_bytes(["    -1", "   151", "Beam 3", "with a joint", "NONE", "", "", "LMS", "", "    -1"])
    measured = read(tmp_path, title + other + function.binary(">") + other + function.text())
    assert measured.title == "Beam 3"
    assert measured.facts["description"] == "with a joint"
    assert measured.facts["datasets that are not read"] == "82"
    assert len(measured.columns) == 3


def damaged(data: bytes, old: bytes, new: bytes) -> bytes:
    assert old in data
    return data.replace(old, new, 1)


TEXT, BINARY = example(DOUBLE_COMPLEX, even=True), example(DOUBLE_REAL, even=False)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (TEXT.text()[:-60], r"dataset 1, line 9: says that 14 numbers follow, but there are 1[0-3]"),
        (damaged(TEXT.text(), b"         7         1", b"         8         1"), "line 9: says that 16 numbers follow"),
        (damaged(TEXT.text(), b"         7         1", b"         6         1"), "line 9: says that 12 numbers follow"),
        (damaged(TEXT.text(), b"E+01\n", b"E+x1\n"), r'line 14: ".*7\.625.* is not a record of 4 numbers'),
        (damaged(TEXT.text(), b"         6         7", b"         3         7"), "type of values 3"),
        (damaged(TEXT.text(), b"    4         0", b"   44         0"), "type of function 44"),
        (damaged(TEXT.text(), b"  2.50000E-01", b"  2.5000E+999"), "begins at 10 with steps of inf"),
        (BINARY.binary("<")[:-20], r"dataset 1, line 9: 7 values need 112 bytes, the file ends after 99"),
        (damaged(BINARY.binary("<"), b"         7         0", b"         6         0"), "6 values need 96 bytes"),
        (damaged(BINARY.binary("<"), b"b     1", b"b     2"), "line 2: says that its values are big endian"),
        (damaged(BINARY.binary(">"), b"b     2", b"b     1"), "line 2: says that its values are little endian"),
        (damaged(BINARY.binary("<"), b"b     1", b"b     3"), "byte order 3 is unknown"),
        (damaged(BINARY.binary("<"), b"b     1     2", b"b     1     1"), "DEC VMS"),
        (TEXT.text() + BINARY.binary("<") + BINARY.binary("<")[:-40], r"dataset 3 at byte \d+: 7 values need"),
        (TEXT.text() + b"garbage\n" + TEXT.text(), r'line 19: "garbage" stands where dataset 2 should begin'),
        (nodes([(1, 0.0, 0.0, 0.0), (1, 1.0, 0.0, 0.0)]), "line 4: node 1 appears twice"),
        (
            nodes([(1, 0.0, 0.0, 0.0)]).replace(b"0.00000E+00", b"0.0000xE+00"),
            "line 3: .* is not a record of 7 numbers",
        ),
        (units(1, 0.0, 1.0), "length 0 .* must be positive"),
        (units(1, 1.0, 1.0)[:-7] + TEXT.text()[7:], 'line 6: type 164 has at most 3 lines; is a line "    -1" lost'),
        (shape(2, 2, [1.0, 1.0, 0.0, 0.0], [(1, [1.0, 2.0])], 3), r"dataset 1, line 11: node 1 has 2 values"),
    ],
)
def test_damage_is_one_sentence_with_dataset_and_place(tmp_path: Path, data: bytes, message: str) -> None:
    with pytest.raises(CampaignError, match=message) as error:
        read(tmp_path, data)
    assert str(error.value).startswith("beam.uff, ")
    assert "\n" not in str(error.value)


def test_every_truncation_of_a_binary_file_is_a_sentence_or_whole_datasets(tmp_path: Path) -> None:
    data = BINARY.binary("<") + TEXT.binary(">")
    for length in range(1, len(data) - len(b"    -1\n")):
        try:
            columns = read(tmp_path, data[:length]).columns
        except CampaignError:
            continue
        assert len(columns) == 2, length
        assert length >= len(BINARY.binary("<")) - len(b"    -1\n"), length
        np.testing.assert_array_equal(columns[1].values, BINARY.y)


@pytest.mark.parametrize("whole", [BINARY.binary("<"), TEXT.text()])
def test_a_last_dataset_without_its_closing_line_is_said(tmp_path: Path, whole: bytes) -> None:
    # Within a line of -1 between two datasets, a cut leaves whole datasets and loses the next ones.
    line = b"    -1\n"
    assert NOT_CLOSED not in read(tmp_path, whole + whole).facts
    for kept in (*range(-len(line), -2), *range(1, 5)):
        measured = read(tmp_path, (whole + whole)[: len(whole) + kept])
        assert measured.facts[NOT_CLOSED].startswith("does not end with a whole line of -1 behind dataset 1;"), kept


def test_what_pyuff_writes_comes_back(tmp_path: Path) -> None:
    pyuff = pytest.importorskip("pyuff", reason="pyuff is not installed")
    for kind, even, binary in itertools.product(KINDS, (True, False), (0, 1)):
        function = example(kind, even=even)
        path = tmp_path / f"{kind}{even}{binary}.uff"
        dataset = pyuff.prepare_58(
            binary=binary, func_type=4, rsp_node=12, rsp_dir=3, ref_node=1, ref_dir=-3, data=function.y, x=function.x,
            id1="id one", rsp_ent_name="NONE", ref_ent_name="NONE", abscissa_spacing=int(even),
            abscissa_spec_data_type=18, ordinate_spec_data_type=12, orddenom_spec_data_type=13,
        )  # fmt: skip
        dataset["ord_data_type"] = kind
        writer = pyuff.UFF(str(path))
        writer.write_sets(
            [
                pyuff.prepare_164(units_code=5, length=1000.0, force=1.0, temp=1.0, temp_offset=0.0),
                pyuff.prepare_15(node_nums=[12], x=[500.0], y=[-1.0], z=[0.25]),
                dataset,
            ],
            "overwrite",
            force_double=False,
        )
        measured = read_file(path)
        check(MeasuredFile(path=path, format="uff", columns=measured.columns), function)
        np.testing.assert_allclose(measured.nodes[12], [0.5, -0.001, 0.00025], rtol=1e-15)


def test_what_we_write_comes_back_and_pyuff_reads_it(tmp_path: Path) -> None:
    frequency = 10.0 + 0.25 * np.arange(9)
    response = np.exp(1j * frequency) * 1e-6
    uneven = frequency**1.5
    columns = (
        Column(name="frequency", values=frequency, unit="Hz"),
        Column(
            name="H", values=response, unit="m/s^2/N", abscissa="frequency", function="frequency response",
            response=Point(node=2, direction="-rz", name="tip"), reference=Point(node=1, direction="+z"),
        ),
        Column(name="time", values=uneven, unit="s"),
        Column(name="x", values=np.sin(uneven), unit="mm", abscissa="time", function="time"),
    )  # fmt: skip
    measured = MeasuredFile(
        path=tmp_path / "beam", format="", title="beam", columns=columns, nodes={2: np.array([0.5, 0.0, -0.25])}
    )
    for binary in (False, True):
        path = tmp_path / f"{binary}.uff"
        write_uff(measured, path, binary=binary)
        again = read_file(path)
        assert again.title == "beam"
        np.testing.assert_array_equal(again.nodes[2], [0.5, 0.0, -0.25])
        frequency_again, first, time_again, second = again.columns
        np.testing.assert_array_equal(frequency_again.values, frequency)
        # Text has 12 digits of values and 6 of an uneven abscissa.
        np.testing.assert_allclose(first.values, response, rtol=0 if binary else 1e-11)
        np.testing.assert_allclose(second.values, np.sin(uneven), rtol=0 if binary else 1e-11)
        np.testing.assert_allclose(time_again.values, uneven, rtol=0 if binary else 1e-5)
        assert (first.unit, second.unit, first.function) == ("m/s^2/N", "mm", "frequency response")
        assert first.response is not None
        assert (first.response.node, first.response.direction, first.response.name) == (2, "-rz", "tip")
        pyuff = pytest.importorskip("pyuff", reason="pyuff is not installed")
        theirs = pyuff.UFF(str(path)).read_sets([3])
        np.testing.assert_allclose(theirs["data"], response, rtol=1e-11)
        assert (theirs["rsp_node"], theirs["rsp_dir"], theirs["rsp_ent_name"].strip()) == (2, -6, "tip")


def test_a_column_without_a_fitting_abscissa_is_not_written(tmp_path: Path) -> None:
    columns = (Column(name="t", values=np.arange(3.0)), Column(name="x", values=np.arange(4.0), abscissa="t"))
    with pytest.raises(CampaignError, match='"x" has 4 values, its abscissa "t" has 3'):
        write_uff(MeasuredFile(path=tmp_path, format="", columns=columns), tmp_path / "x.uff")


def test_functions_of_the_description_have_their_numbers() -> None:
    assert FUNCTIONS[1] == "time"
    assert FUNCTIONS[4] == "frequency response"
    assert FUNCTIONS[6] == "coherence"
    assert FUNCTIONS[9] == "power spectral density"
    assert len(FUNCTIONS) == 28
