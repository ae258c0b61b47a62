"""Damaged MATLAB files: every byte that is changed gives a sentence or numbers, and never ends the program."""

import contextlib
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

from geometry.errors import InputError
from reduction.file.matlab_elements import MatlabFileError, read_variables
from reduction.file.structure_file import load_matrices
from reduction.nlvib import load_nlvib

SPARSE = sp.csc_array(sp.random_array((5, 5), density=0.4, rng=np.random.default_rng(3)))


@pytest.mark.parametrize("compressed", [False, True])
def test_sparse_matrices_are_read_as_scipy_reads_them(tmp_path: Path, compressed: bool) -> None:
    written = {"real": SPARSE, "complex": SPARSE * (1 + 2j), "empty": sp.csc_array((3, 4))}
    scipy.io.savemat(tmp_path / "m.mat", written, do_compression=compressed)
    read = {value.name: value.content for value in read_variables((tmp_path / "m.mat").read_bytes())}
    for name, matrix in written.items():
        np.testing.assert_array_equal(read[name].toarray(), matrix.toarray())


def test_indices_of_a_sparse_matrix_that_lie_outside_it_are_refused(tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "m.mat", {"K": SPARSE})
    data = (tmp_path / "m.mat").read_bytes()
    rows = SPARSE.indices.astype("<i4").tobytes()
    assert rows in data
    with pytest.raises(MatlabFileError, match="not there"):
        list(read_variables(data.replace(rows, b"\xff\xff\xff\x7f" + rows[4:])))


@pytest.mark.parametrize("compressed", [False, True])
def test_a_damaged_byte_anywhere_is_a_sentence_or_another_number(tmp_path: Path, compressed: bool) -> None:
    path = tmp_path / "m.mat"
    scipy.io.savemat(path, {"M": np.eye(2), "K": sp.csc_array(2 * np.eye(2)), "s": "x"}, do_compression=compressed)
    whole = path.read_bytes()
    refused = 0
    for place in range(116, len(whole)):
        for mask in (0x01, 0xFF):
            path.write_bytes(whole[:place] + bytes([whole[place] ^ mask]) + whole[place + 1 :])
            try:
                load_matrices(path)
            except InputError:
                refused += 1
            with contextlib.suppress(InputError):
                load_nlvib(path)
    assert refused > 100
