"""Damaged matrix files: what is not there is no zero, and no file takes more memory than its bytes can fill."""

import tracemalloc
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

from fe.errors import MatrixFileError
from fe.file.matrix_file import MatrixSource, read_matrix

#: Files of a few bytes take no more than this, libraries that are imported while reading included [byte].
MEMORY = 20_000_000

DENSE = "%%MatrixMarket matrix array real symmetric\n2 2\n4.0\n-1.0\n3.0\n"
SPARSE = "%%MatrixMarket matrix coordinate real symmetric\n2 2 3\n1 1 4.0\n2 1 -1.0\n2 2 3.0\n"


def read(path: Path, text: str) -> sp.csr_array:
    path.write_text(text)
    return read_matrix(MatrixSource(file=path)).matrix


@pytest.fixture
def little_memory() -> Iterator[None]:
    tracemalloc.start()
    yield
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < MEMORY


@pytest.mark.parametrize("whole", [DENSE, SPARSE], ids=["dense", "sparse"])
def test_a_matrix_market_file_that_is_cut_after_any_value_is_refused(tmp_path: Path, whole: str) -> None:
    np.testing.assert_array_equal(read(tmp_path / "k.mtx", whole).toarray(), [[4.0, -1.0], [-1.0, 3.0]])
    lines = whole.splitlines(keepends=True)
    for kept in range(len(lines)):
        with pytest.raises(MatrixFileError, match="or damaged"):
            read(tmp_path / "k.mtx", "".join(lines[:kept]))


@pytest.mark.parametrize(("name", "text"), [("k.mtx", SPARSE), ("k.mtx", DENSE), ("k.sti", "1 1 4.0\n2 2 3.25\n")])
def test_a_file_that_is_cut_within_its_last_number_is_refused(tmp_path: Path, name: str, text: str) -> None:
    read(tmp_path / name, text)
    for kept in range(1, 4):
        with pytest.raises(MatrixFileError, match="within its last number"):
            read(tmp_path / name, text[:-kept])


def test_a_symmetric_matrix_market_file_with_both_halves_is_not_summed(tmp_path: Path) -> None:
    both = SPARSE.replace("2 2 3\n", "2 2 4\n") + "1 2 -1.0\n"
    np.testing.assert_array_equal(read(tmp_path / "k.mtx", both).toarray(), [[4.0, -1.0], [-1.0, 3.0]])


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("3.0\n", "2E"),
        ("3.0", "three"),
        ("3.0", "3.0 1.0"),
        ("2 2 3\n", "2 2 -3\n"),
        ("2 2 3\n", "2 2\n"),
        ("2 1 -1.0", "2 0 -1.0"),
        ("2 1 -1.0", "1 1 -1.0"),
        ("real symmetric", "real skew-symmetric"),
        ("coordinate", "coordinates"),
    ],
)
def test_a_matrix_market_file_that_is_damaged_is_refused(tmp_path: Path, old: str, new: str) -> None:
    assert old in SPARSE
    with pytest.raises(MatrixFileError, match=r"k\.mtx"):
        read(tmp_path / "k.mtx", SPARSE.replace(old, new))


def test_a_dense_matrix_market_file_is_read_column_by_column(tmp_path: Path) -> None:
    full = np.arange(9.0).reshape(3, 3) ** 2
    scipy.io.mmwrite(tmp_path / "k.mtx", full)
    np.testing.assert_array_equal(read_matrix(MatrixSource(file=tmp_path / "k.mtx")).matrix.toarray(), full)
    scipy.io.mmwrite(tmp_path / "k.mtx", full + full.T, symmetry="symmetric")
    np.testing.assert_array_equal(read_matrix(MatrixSource(file=tmp_path / "k.mtx")).matrix.toarray(), full + full.T)


HARWELL_BOEING = """\
stiffness                                                               k
             3             1             1             1             0
RSA             2000000000    2000000000             1             0
(4I4)           (3I4)           (2D22.15)
   1   2   2
   1
 0.400000000000000D+01
"""


@pytest.mark.usefixtures("little_memory")
@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("k.mtx", SPARSE.replace("2 2 3", "2000000000 2000000000 3")),
        ("k.mtx", DENSE.replace("2 2", "2000000000 2000000000")),
        ("k.sti", "1 1 4.0\n2000000000 2000000000 3.0\n"),
        ("k.hb", HARWELL_BOEING),
        ("k.op4", "20000000002000000000      6       2KAA     1P,3E23.16\n"),
    ],
)
def test_a_size_that_the_bytes_cannot_fill_is_refused_before_memory_is_taken(
    tmp_path: Path, name: str, text: str
) -> None:
    with pytest.raises(MatrixFileError, match=r"k\."):
        read(tmp_path / name, text)


def test_an_index_beyond_64_bits_in_a_harwell_boeing_file_is_refused(tmp_path: Path) -> None:
    scipy.io.hb_write(tmp_path / "k.hb", sp.csc_array(np.eye(2)))
    lines = (tmp_path / "k.hb").read_text().splitlines()
    lines[4] = "1 99999999999999999999 3"
    with pytest.raises(MatrixFileError, match="64 bits"):
        read(tmp_path / "k.hb", "\n".join(lines))


@pytest.mark.parametrize("format_", ["csr", "csc", "bsr", "coo", "dia"])
def test_indices_of_an_npz_file_that_lie_outside_its_matrix_are_refused(tmp_path: Path, format_: str) -> None:
    matrix = sp.csr_array(np.eye(6) + np.eye(6, k=1) + np.eye(6, k=-1)).asformat(format_)
    sp.save_npz(tmp_path / "k.npz", matrix)
    with np.load(tmp_path / "k.npz") as file:
        arrays = dict(file)
    for name in {"indices", "indptr", "coords", "row", "shape"} & {*arrays}:
        spoilt = arrays[name].copy()
        spoilt.flat[-1] = 2_000_000_000
        np.savez(tmp_path / "k.npz", **{**arrays, name: spoilt})
        with pytest.raises(MatrixFileError, match=r"k\.npz"):
            read_matrix(MatrixSource(file=tmp_path / "k.npz"))
