"""Arrays whose first column rises in equal steps."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from correlation.file.column import Column
from correlation.file.read_file import read_file

TIME = np.arange(400) / 4000.0
DECAY = np.exp(-TIME / 0.02) * np.cos(2000.0 * TIME)
LINES = np.arange(400) * 0.5


def columns(path: Path) -> list[Column]:
    return list(read_file(path).columns)


def saved(folder: Path, **values: Any) -> Path:
    savemat(folder / "a.mat", values)
    return folder / "a.mat"


def test_the_others_of_an_array_are_given_over_its_first_column(tmp_path: Path) -> None:
    time, *others = columns(saved(tmp_path, X1=np.stack([TIME, DECAY, -DECAY], axis=1)))
    assert time.name == "X1(:,1)"
    assert [(one.name, one.abscissa) for one in others] == [("X1(:,2)", "X1(:,1)"), ("X1(:,3)", "X1(:,1)")]


def test_arrays_of_equal_first_columns_share_one_and_others_have_their_own(tmp_path: Path) -> None:
    arrays = {
        "X1": np.stack([TIME, DECAY], axis=1),
        "X2": np.stack([TIME, -DECAY], axis=1),
        "X3": np.stack([2 * TIME, DECAY], axis=1),
    }
    result = {one.name: one.abscissa for one in columns(saved(tmp_path, **arrays))}
    assert result == {
        "X1(:,1)": None, "X1(:,2)": "X1(:,1)", "X2(:,2)": "X1(:,1)", "X3(:,1)": None, "X3(:,2)": "X3(:,1)",
    }  # fmt: skip


def test_the_first_column_of_complex_numbers_is_real(tmp_path: Path) -> None:
    lines, ratio = columns(saved(tmp_path, H=np.stack([LINES, DECAY + 1j], axis=1)))
    assert lines.values.dtype == np.float64
    np.testing.assert_array_equal(lines.values, LINES)
    assert ratio.abscissa == lines.name


def test_a_cell_of_times_is_that_of_the_cells_beside_it(tmp_path: Path) -> None:
    cells = np.empty((2, 2), dtype=object)
    for row, length in enumerate((300, 400)):
        cells[row] = [TIME[:length], np.stack([DECAY[:length], -DECAY[:length]])]
    result = {one.name: one.abscissa for one in columns(saved(tmp_path, data=cells))}
    assert result["data{2,2}(1,:)"] == "data{2,1}"
    assert result["data{1,2}(2,:)"] == "data{1,1}"


def test_a_first_row_of_an_hdf5_file_is_an_abscissa(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["run/acc"] = np.stack([TIME, DECAY])
    assert [one.abscissa for one in columns(tmp_path / "a.h5")] == [None, "run/acc[0]"]


@pytest.mark.parametrize(
    "array",
    [np.stack([DECAY, TIME]), np.stack([TIME**2, DECAY]), np.stack([TIME, LINES]), np.stack([TIME, DECAY])[:, :9]],
)
def test_other_arrays_have_none(tmp_path: Path, array: np.ndarray) -> None:
    assert {one.abscissa for one in columns(saved(tmp_path, X=array.T))} == {None}
