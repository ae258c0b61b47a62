"""Archives of arrays: what a heading announces is compared with the bytes behind it before memory is taken."""

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

from fe.file.npz_archive import NpzError, ObjectArray, read_npz, read_npz_headings


def forged(path: Path, shape: tuple[int, ...]) -> None:
    """An archive with one array of three numbers, whose heading announces another shape."""
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": "<f8", "fortran_order": False, "shape": shape})
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("M.npy", stream.getvalue() + np.arange(3.0).tobytes())


def test_arrays_are_read_as_they_were_written(tmp_path: Path) -> None:
    arrays = {"M": np.arange(6.0).reshape(2, 3), "n": np.array(7), "word": np.array("tip")}
    for write in (np.savez, np.savez_compressed):
        write(tmp_path / "a.npz", **arrays)
        assert {name: shape for name, (shape, _) in read_npz_headings(tmp_path / "a.npz").items()} == {
            "M": (2, 3), "n": (), "word": ()
        }  # fmt: skip
        for name, array in read_npz(tmp_path / "a.npz").items():
            np.testing.assert_array_equal(array, arrays[name])
        assert list(read_npz(tmp_path / "a.npz", {"n"})) == ["n"]


@pytest.mark.parametrize("shape", [(2_000_000_000,), (60_000, 60_000), (2,), (4,), (2**40, 2**40)])
def test_a_heading_that_announces_other_bytes_than_follow_is_refused(tmp_path: Path, shape: tuple[int, ...]) -> None:
    forged(tmp_path / "a.npz", (3,))
    assert len(read_npz(tmp_path / "a.npz")["M"]) == 3
    forged(tmp_path / "a.npz", shape)
    for read in (read_npz_headings, read_npz):
        with pytest.raises(NpzError, match="announces"):
            read(tmp_path / "a.npz")


def test_every_damaged_byte_is_refused_or_changes_nothing(tmp_path: Path) -> None:
    path, array = tmp_path / "a.npz", np.arange(4.0)
    np.savez(path, M=array)
    whole = path.read_bytes()
    for place in range(len(whole)):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x40]) + whole[place + 1 :])
        try:
            read = read_npz(path)
        except NpzError:
            continue
        if "M" in read:
            np.testing.assert_array_equal(read["M"], array)


def test_a_text_of_letters_that_there_are_not_is_refused(tmp_path: Path) -> None:
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": "<U3", "fortran_order": False, "shape": (1,)})
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("word.npy", stream.getvalue() + np.array([65, 2**31 - 1, 65], "<u4").tobytes())
    with pytest.raises(NpzError, match="word"):
        read_npz(tmp_path / "a.npz")


def test_objects_are_never_read(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", M=np.array([{}, {}], dtype=object))
    with pytest.raises(ObjectArray):
        read_npz(tmp_path / "a.npz")
