"""Matrices in the formats of other programs: what a foreign writer wrote is what is read, to the digits written."""

import struct
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

from fe.errors import MatrixFileError
from fe.file.matrix import MATRIX_FORMATS
from fe.file.matrix_content import FileMatrix, read_fortran_real
from fe.file.matrix_file import MatrixSource, read_matrix
from fe.file.registry import suffixes

RNG = np.random.default_rng(7)
#: Symmetric, with an empty column, a dense block and negative entries of many magnitudes.
FULL = sp.random_array((9, 9), density=0.3, rng=RNG).toarray() * 10.0 ** RNG.integers(-8, 9, (9, 9))
FULL[2:5, 2:5] = -RNG.standard_normal((3, 3))
FULL[:, 6] = FULL[6, :] = 0.0
FULL = FULL + FULL.T
SPARSE = sp.csr_array(FULL)


def read(path: Path, name: str = "") -> FileMatrix:
    return read_matrix(MatrixSource(file=path, name=name))


@pytest.mark.parametrize("symmetry", ["general", "symmetric"])
def test_matrix_market_of_scipy_is_read_to_the_last_bit(tmp_path: Path, symmetry: str) -> None:
    scipy.io.mmwrite(tmp_path / "k.mtx", sp.coo_array(SPARSE), symmetry=symmetry, precision=17)
    np.testing.assert_array_equal(read(tmp_path / "k.mtx").matrix.toarray(), FULL)


def test_a_dense_matrix_market_file_of_integers_is_read(tmp_path: Path) -> None:
    scipy.io.mmwrite(tmp_path / "k.mtx", np.array([[2, -1], [-1, 2]]))
    np.testing.assert_array_equal(read(tmp_path / "k.mtx").matrix.toarray(), [[2, -1], [-1, 2]])


def test_a_sparse_npz_of_scipy_is_read_to_the_last_bit(tmp_path: Path) -> None:
    sp.save_npz(tmp_path / "k.npz", SPARSE)
    np.testing.assert_array_equal(read(tmp_path / "k.npz").matrix.toarray(), FULL)


@pytest.mark.parametrize("ending", [".hb", ".rb", ".matrix"])
def test_harwell_boeing_of_scipy_is_read_to_the_digits_written(tmp_path: Path, ending: str) -> None:
    scipy.io.hb_write(tmp_path / f"k{ending}", sp.csc_array(SPARSE))
    # SciPy writes 16 significant digits.
    np.testing.assert_allclose(read(tmp_path / f"k{ending}").matrix.toarray(), FULL, rtol=1e-15)


#: As HBMAT lays it out: the lower triangle, a right-hand side, D exponents and no blanks between columns.
HBMAT = """\
 Stiffness matrix                                                       FILE.FUL
            11             1             2             3             1
RSA                        3             3             5             0
(4I4)           (3I4)           (2D22.15)           (3D22.15)
F                          1             0
   1   3   5   6
   1   2   2
   3   3
 0.200000000000000D+05-0.100000000000000D+05
 0.200000000000000D+05-0.100000000000000D+05
 0.100000000000000D+05
 0.000000000000000D+00 0.000000000000000D+00 0.100000000000000D+01
"""


def test_the_triangle_of_a_symmetric_harwell_boeing_matrix_is_filled_and_its_load_passed_over(tmp_path: Path) -> None:
    (tmp_path / "k.matrix").write_text(HBMAT)
    want = 1e4 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    np.testing.assert_array_equal(read(tmp_path / "k.matrix").matrix.toarray(), want)


#: OUTPUT4 as text, columns as strings of non-zeros: rows packed, and ("bigmat") in numbers of their own.
PACKED = """\
       3       3       6       2K       1P,3E23.16
       1       0       5
  327681
 2.0000000000000000E+04-1.0000000000000000E+04
       2       0       7
  458753
-1.0000000000000000E+04 2.0000000000000000E+04-1.0000000000000000E+04
       3       0       5
  327682
-1.0000000000000000E+04 1.0000000000000000E+04
       4       1       1
 1.0000000000000000E+00
"""
BIGMAT = """\
       3      -3       6       2K       1P,3E23.16
       1       0       6
       5       1
 2.0000000000000000E+04-1.0000000000000000E+04
       2       0       8
       7       1
-1.0000000000000000E+04 2.0000000000000000E+04-1.0000000000000000E+04
       3       0       6
       5       2
-1.0000000000000000E+04 1.0000000000000000E+04
       4       1       1
 1.0000000000000000E+00
"""
CHAIN = 1e4 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])


@pytest.mark.parametrize("text", [PACKED, BIGMAT])
def test_strings_of_a_text_output4_are_read(tmp_path: Path, text: str) -> None:
    (tmp_path / "k.op4").write_text(text)
    np.testing.assert_array_equal(read(tmp_path / "k.op4").matrix.toarray(), CHAIN)


def record(order: str, content: bytes) -> bytes:
    length = struct.pack(f"{order}i", len(content))
    return length + content + length


def output4(order: str, kind: int, layout: str) -> bytes:
    """The chain in binary: whole columns, packed strings or bigmat; single (1) or double (2) precision."""
    value, words = ("f", 1) if kind == 1 else ("d", 2)
    rows = -3 if layout == "bigmat" else 3
    content = record(order, struct.pack(f"{order}4i8s", 3, rows, 6, kind, b"K       "))
    for column in range(3):
        own = np.flatnonzero(CHAIN[:, column])
        first, count = own[0] + 1, len(own) * words
        data = struct.pack(f"{order}{len(own)}{value}", *CHAIN[own, column])
        if layout == "bigmat":
            data, start = struct.pack(f"{order}2i", count + 1, first) + data, 0
        elif layout == "packed":
            data, start = struct.pack(f"{order}i", 65536 * (count + 1) + first) + data, 0
        else:
            start = first
        content += record(order, struct.pack(f"{order}3i", column + 1, start, len(data) // 4) + data)
    return content + record(order, struct.pack(f"{order}3i{value}", 4, 1, words, 1.0))


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("kind", [1, 2])
@pytest.mark.parametrize("layout", ["columns", "packed", "bigmat"])
def test_a_binary_output4_is_read_in_either_byte_order(tmp_path: Path, order: str, kind: int, layout: str) -> None:
    (tmp_path / "k.op4").write_bytes(output4(order, kind, layout))
    # The entries are whole numbers, exact in single precision.
    np.testing.assert_array_equal(read(tmp_path / "k.op4").matrix.toarray(), CHAIN)


def test_a_matrix_is_found_by_its_name_among_several(tmp_path: Path) -> None:
    (tmp_path / "k.op4").write_text(PACKED + PACKED.replace("2K ", "2M ").replace("E+04", "E+00"))
    np.testing.assert_array_equal(read(tmp_path / "k.op4", "M").matrix.toarray(), 1e-4 * CHAIN)
    with pytest.raises(MatrixFileError, match="holds several matrices: name one of K, M"):
        read(tmp_path / "k.op4")
    with pytest.raises(MatrixFileError, match='holds no matrix "C": name one of K, M'):
        read(tmp_path / "k.op4", "C")


@pytest.mark.parametrize("form", ["dense", "bigmat", "nonbigmat"])
@pytest.mark.parametrize("binary", [False, True])
def test_the_output4_of_pyyeti_is_read_to_the_last_bit(tmp_path: Path, form: str, binary: bool) -> None:
    op4 = pytest.importorskip("pyyeti.nastran.op4", reason="pyyeti, an independent writer, is not installed")
    op4.write(str(tmp_path / "k.op4"), {"K": FULL, "M": SPARSE}, binary=binary, digits=16, sparse=form)
    for name in ("K", "M"):
        np.testing.assert_array_equal(read(tmp_path / "k.op4", name).matrix.toarray(), FULL)


#: Of a chain of the grid points 11, 12 and 7, z direction: fields of 16, of 8, and commas.
WIDE = """\
$ stiffness
DMIG    KAAX           0       6       2       0                       3
DMIG*   KAAX                          11               3
*                     11               3 2.000000000D+04
DMIG*   KAAX                          12               3
*                     11               3-1.000000000D+04
*                     12               3 2.000000000D+04
DMIG*   KAAX                           7               3
*                     12               3-1.000000000D+04
*                      7               3 1.000000000D+04
ENDDATA
"""
NARROW = """\
DMIG    KAAX           0       6       1       0
DMIG    KAAX          11       3              11       3    2.+4
DMIG    KAAX          12       3              11       3   -1.+4        +
+             12       3 20000.0
DMIG    KAAX           7       3              12       3 -1.E+04
+              7       3 10000.0
"""
TABS = NARROW.replace("+             12       3 ", "\t12\t3\t").replace("DMIG    KAAX", "DMIG\tKAAX")
COMMAS = """\
DMIG,KAAX,0,6,2,0,,,3
DMIG,KAAX,11,3,,11,3,2.D4
DMIG,KAAX,12,3,,11,3,-1.D4,
,12,3,2.D4
DMIG,KAAX,7,3,,12,3,-1.D4,
,7,3,1.D4
"""


@pytest.mark.parametrize("text", [WIDE, NARROW, TABS, COMMAS])
def test_dmig_cards_name_their_degrees_of_freedom(tmp_path: Path, text: str) -> None:
    (tmp_path / "k.pch").write_text(text)
    result = read(tmp_path / "k.pch")
    assert result.dofs is not None
    # Ascending by grid point: 7, 11, 12.
    assert [result.dofs.name(row) for row in range(3)] == ["node 7 z", "node 11 z", "node 12 z"]
    np.testing.assert_array_equal(result.matrix.toarray(), CHAIN[np.ix_([2, 0, 1], [2, 0, 1])])


def test_the_dmig_cards_of_pyyeti_are_read_to_the_digits_written(tmp_path: Path) -> None:
    bulk = pytest.importorskip("pyyeti.nastran.bulk", reason="pyyeti, an independent writer, is not installed")
    pandas = pytest.importorskip("pandas")
    grids = [(grid, component) for grid in (4, 2, 9) for component in (1, 2, 5)]
    index = pandas.MultiIndex.from_tuples(grids, names=["id", "dof"])
    bulk.wtdmig(str(tmp_path / "k.pch"), {"KAAX": pandas.DataFrame(FULL, index=index, columns=index)})
    result = read(tmp_path / "k.pch")
    assert result.dofs is not None
    place = [grids.index((n, d + 1)) for n, d in zip(result.dofs.node, result.dofs.direction, strict=True)]
    assert sorted(place) == list(np.flatnonzero(FULL.any(axis=0)))  # cards leave out a row of zeros
    # Ten digits fit into a field of 16 beside sign and exponent.
    np.testing.assert_allclose(result.matrix.toarray(), FULL[np.ix_(place, place)], rtol=1e-9)


@pytest.mark.parametrize(
    ("text", "value"), [("1.5D+03", 1500.0), (" 1.5-103", 1.5e-103), ("-2.+4", -2e4), (".5d1", 5.0), ("7", 7.0)]
)
def test_numbers_of_fortran_are_read(text: str, value: float) -> None:
    assert read_fortran_real(text) == value


#: As Abaqus writes it, of nodes 7, 1 and 2, not in the order of their numbers: one triangle.
ABAQUS = """\
**
** STIFFNESS
7,1, 7,1, 2.000000000000000e+04
1,1, 7,1,-1.000000000000000e+04
1,1, 1,1, 2.000000000000000e+04
2,1, 1,1,-1.000000000000000e+04
2,1, 2,1, 1.000000000000000e+04
2,6, 2,6, 5.000000000000000e+00
"""


def test_a_matrix_of_abaqus_names_its_degrees_of_freedom(tmp_path: Path) -> None:
    (tmp_path / "k.mtx").write_text(ABAQUS)
    result = read(tmp_path / "k.mtx")
    assert result.dofs is not None
    assert list(zip(result.dofs.node.tolist(), result.dofs.direction.tolist(), strict=True)) == [
        (1, 0), (2, 0), (2, 5), (7, 0)
    ]  # fmt: skip
    expected = [[2e4, -1e4, 0, -1e4], [-1e4, 1e4, 0, 0], [0, 0, 5, 0], [-1e4, 0, 0, 2e4]]
    np.testing.assert_array_equal(result.matrix.toarray(), expected)
    # Some versions write both halves.
    (tmp_path / "k.mtx").write_text(ABAQUS + "7,1, 1,1, -1e4\n1,1, 2,1, -1e4\n")
    np.testing.assert_array_equal(read(tmp_path / "k.mtx").matrix.toarray(), expected)


BAD_TEXTS = [
    ("k.mtx", "%%MatrixMarket matrix coordinate real general\n2 3 1\n1 1 5.0\n", "2 x 3: it must be square"),
    ("k.mtx", "%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 5.0\n", "not a MatrixMarket file, or damaged"),
    ("k.mtx", "%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 5.0 1.0\n", "holds complex numbers"),
    ("k.mtx", "%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 5.0\n2 1 nan\n", "nan in row 1, column 0"),
    (
        "k.mtx",
        ABAQUS.replace("2,6, 2,6,", "2,11, 2,11,"),
        "has the degree of freedom 11: remove all degrees of freedom except displacements",
    ),
    ("k.mtx", ABAQUS.replace("5.000000000000000e+00", "1e36"), "node 2 rotz is fixed by 1e36.* without it"),
    ("k.mtx", ABAQUS + "2,1, 2,1, 1.\n", "gives an entry twice"),
    ("k.mtx", ABAQUS + "2,1, 2,1\n", "is not a matrix of Abaqus, or damaged"),
    ("k.mtx", ABAQUS.replace("7,1, 7,1", "-7,1, -7,1"), "is not a matrix of Abaqus, or damaged"),
    ("k.mtx", ABAQUS.rstrip(), "truncated within its last number"),
    ("k.hb", "nonsense", "no Harwell-Boeing heading"),
    ("k.matrix", HBMAT.replace("RSA", "CSA"), "type CSA, complex numbers"),
    ("k.matrix", HBMAT.replace("RSA", "RSE"), "type RSE, matrices of single elements"),
    ("k.matrix", HBMAT.replace("   3   3\n", "   3\n"), "4 rows and 5 values, but its heading announces 4, 5 and 5"),
    ("k.matrix", HBMAT.replace("   3   3\n", "   3   4\n"), "rows outside its 3 x 3 matrix"),
    ("k.matrix", HBMAT.replace(" 0.1000000000", " 0.1oo0000000"), "does not hold the numbers"),
    ("k.matrix", "\n".join(HBMAT.splitlines()[:8]), "holds 4 column starts, 5 rows and 0 values"),
    ("k.op4", "nonsense", "truncated, damaged or not an OUTPUT4 file"),
    ("k.op4", PACKED[:200], "truncated, damaged or not an OUTPUT4 file"),
    ("k.op4", PACKED.replace("6       2K", "6       4K"), "K is complex"),
    ("k.pch", "GRID,1\n", "holds no DMIG card"),
    ("k.pch", WIDE.replace("6       2  ", "6       4  "), "KAAX is complex"),
    ("k.pch", WIDE.replace("0       6", "0       2"), "KAAX is of form 2, which is not square"),
    ("k.pch", WIDE.replace("DMIG    KAAX           0 ", "$"), "have no heading"),
    ("k.pch", WIDE.replace("11               3 2", "11               9 2"), "line 3: the DMIG card of KAAX cannot be"),
    ("k.pch", COMMAS.replace("7,3", f"{10**30},3"), f'k.pch": the row 2 belongs to node {10**30}, but nodes are 0 to'),
    ("k.pch", COMMAS.replace("7,3", f"{'7' * 5000},3"), "line 5: the DMIG card of KAAX cannot be read"),
    (
        "k.pch",
        NARROW.replace("+             12", "?             12"),
        r'line 4: "\?  .*" is neither a card nor the contin',
    ),
    ("k.sti", "1 1\n", "not a CalculiX matrix, or damaged"),
    (
        "k.mtx",
        "%%MatrixMarket matrix coordinate pattern general\n1 1 1\n1 1\n",
        "entries without values .pattern.: write",
    ),
    ("k.sti", "", "not a CalculiX matrix, or damaged"),
    ("k.sti", "nan 1 2.0\n", "not a CalculiX matrix, or damaged"),
    ("k.sti", "1.7 1 2.0\n", "not a CalculiX matrix, or damaged"),
    ("k.sti", "1 1e19 2.0\n", "not a CalculiX matrix, or damaged"),
    ("k.sti", "0 1 2.0\n", "not a CalculiX matrix, or damaged"),
    ("k.mas", "1 1 one\n", "not a CalculiX matrix, or damaged"),
    ("k.npz", "PK", "not a sparse matrix"),
    ("k.txt", "1", r'ends in "\.txt": give a matrix as one of .*\.mtx'),
]


@pytest.mark.filterwarnings("error")  # nothing of NumPy's own beside the sentence
@pytest.mark.parametrize(("name", "text", "message"), BAD_TEXTS)
def test_a_file_that_holds_no_real_square_matrix_is_refused(tmp_path: Path, name: str, text: str, message: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(MatrixFileError, match=message):
        read(tmp_path / name)


@pytest.fixture(params=suffixes(MATRIX_FORMATS))
def matrix_suffix(request: pytest.FixtureRequest) -> str:
    """Each format in turn: a new one is tested without a word here."""
    return str(request.param)


@pytest.mark.parametrize("content", [b"", np.random.default_rng(5).bytes(3000)], ids=["empty", "noise"])
def test_an_empty_file_and_noise_are_refused_in_one_line(tmp_path: Path, matrix_suffix: str, content: bytes) -> None:
    (tmp_path / f"k{matrix_suffix}").write_bytes(content)
    with pytest.raises(MatrixFileError, match=rf"k\{matrix_suffix}") as refusal:
        read(tmp_path / f"k{matrix_suffix}")
    assert "\n" not in str(refusal.value)


def test_a_sparse_vector_is_refused(tmp_path: Path) -> None:
    sp.save_npz(tmp_path / "k.npz", sp.coo_array(np.ones(3)))
    with pytest.raises(MatrixFileError, match=r"holds an array of shape \(3,\): it must be a square matrix"):
        read(tmp_path / "k.npz")


def test_a_binary_output4_that_is_cut_short_is_refused_wherever_it_ends(tmp_path: Path) -> None:
    whole = output4("<", 2, "bigmat")
    for length in range(0, len(whole) - 4, 7):
        (tmp_path / "k.op4").write_bytes(whole[:length])
        with pytest.raises(MatrixFileError, match=r"truncated, damaged|holds no matrix"):
            read(tmp_path / "k.op4")


def test_missing_files_and_folders_are_refused(tmp_path: Path) -> None:
    with pytest.raises(MatrixFileError, match="there is no file"):
        read(tmp_path / "k.mtx")
    with pytest.raises(MatrixFileError, match="is a folder"):
        read(tmp_path)
