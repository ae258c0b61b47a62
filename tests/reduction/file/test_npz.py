"""Arrays as .npz: NumPy reads what is written, the same bytes come out each time, and nothing is pickled."""

from io import BytesIO
from zipfile import ZIP_DEFLATED, ZIP_STORED

import numpy as np
import pytest

from reduction.file.npz import write_npz

ARRAYS = {"a": np.arange(6.0).reshape(2, 3), "text": "Prüfer", "n": 7}


def written(compression: int) -> bytes:
    whole = BytesIO()
    write_npz(whole, ARRAYS, compression)
    return whole.getvalue()


@pytest.mark.parametrize("compression", [ZIP_STORED, ZIP_DEFLATED])
def test_numpy_reads_exactly_the_arrays_that_were_given(compression: int) -> None:
    with np.load(BytesIO(written(compression)), allow_pickle=False) as file:
        assert set(file.files) == set(ARRAYS)
        for name, array in ARRAYS.items():
            np.testing.assert_array_equal(file[name], array)


def test_the_same_arrays_make_the_same_bytes_whenever_they_are_written(monkeypatch: pytest.MonkeyPatch) -> None:
    first = written(ZIP_STORED)
    monkeypatch.setattr("time.time", lambda: 2e9)
    assert written(ZIP_STORED) == first


def test_python_objects_are_refused() -> None:
    with pytest.raises(ValueError, match="Object arrays cannot be saved"):
        write_npz(BytesIO(), {"a": np.array([None])})
