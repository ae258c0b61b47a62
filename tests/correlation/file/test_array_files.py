"""MATLAB and HDF5 files: structures, cells, texts, references, sparse and empty arrays."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

from correlation.errors import CampaignError
from correlation.file.column import MeasuredFile
from correlation.file.read_file import read_file

FREQUENCY = np.arange(4.0)
H = (np.arange(8.0) + 1j).reshape(4, 2)


def named(measured: MeasuredFile) -> dict[str, Any]:
    return {column.name: column.values for column in measured.columns}


@pytest.fixture(params=[False, True], ids=["plain", "compressed"])
def matlab(request: pytest.FixtureRequest, tmp_path: Path) -> MeasuredFile:
    cell = np.empty((1, 2), dtype=object)
    cell[0, 0] = {"freq": FREQUENCY, "H": H, "note": "first run"}
    cell[0, 1] = np.empty((2, 2), dtype=object)
    cell[0, 1][:] = [[np.zeros((0, 0)), np.array([7.0, 8.0])], [np.zeros((0, 0)), np.zeros((0, 0))]]
    runs = np.array([(1.0, "x"), (2.0, "y")], dtype=[("level", "f8"), ("name", "O")])
    content = {
        "FRF": cell, "deep": {"a": {"b": [1, 2, 3]}}, "runs": runs, "cube": np.arange(20.0).reshape(5, 2, 2),
        "count": np.arange(3, dtype=np.int16), "flags": np.array([True, False]), "fs": 1000.0, "title": "beam",
        "texts": np.array(["up", "down"]), "empty": np.zeros((0, 3)), "sparse": sp.eye_array(5, format="csc"),
        "none": np.empty((0, 0), dtype=object), "tests": {"f": FREQUENCY, "a": FREQUENCY, "units": "Hz, m/s^2"},
    }  # fmt: skip
    scipy.io.savemat(tmp_path / "data.mat", content, do_compression=request.param)
    return read_file(tmp_path / "data.mat")


def test_numbers_are_columns_with_their_names_in_matlab(matlab: MeasuredFile) -> None:
    columns = named(matlab)
    np.testing.assert_array_equal(columns["FRF{1}.freq"], FREQUENCY)
    np.testing.assert_array_equal(columns["FRF{1}.H(:,2)"], H[:, 1])
    np.testing.assert_array_equal(columns["FRF{2}{1,2}"], [7, 8])
    np.testing.assert_array_equal(columns["deep.a.b"], [1, 2, 3])
    np.testing.assert_array_equal(columns["runs(2).level"], [2])
    np.testing.assert_array_equal(columns["cube(:,2,1)"], np.arange(20.0).reshape(5, 2, 2)[:, 1, 0])
    np.testing.assert_array_equal(columns["count"], [0, 1, 2])
    np.testing.assert_array_equal(columns["flags"], [1, 0])
    np.testing.assert_array_equal(columns["fs"], [1000])


def test_texts_are_facts_and_what_is_not_read_is_named(matlab: MeasuredFile) -> None:
    assert matlab.facts["title"] == "beam"
    assert matlab.facts["FRF{1}.note"] == "first run"
    assert matlab.facts["sparse"] == "not read: a sparse matrix"
    assert matlab.facts["empty"] == "empty, 0 x 3"
    assert matlab.column("FRF{1}.freq").facts["note"] == "first run"
    assert matlab.column("texts").words == ("up", "down")


def test_units_that_list_all_fields_are_those_of_the_columns(matlab: MeasuredFile) -> None:
    assert [matlab.column(name).unit for name in ("tests.f", "tests.a", "FRF{1}.freq")] == ["Hz", "m/s^2", ""]


def test_big_endian_files_of_matlab_are_read(tmp_path: Path) -> None:
    # Header, then miMATRIX of flags (class 6), dimensions, name and values, all big endian.
    def element(kind: int, content: bytes) -> bytes:
        return kind.to_bytes(4, "big") + len(content).to_bytes(4, "big") + content + bytes(-len(content) % 8)

    values = np.array([1.5, -2.0, 3.0])
    inside = element(6, (6).to_bytes(4, "big") + bytes(4)) + element(5, np.array([3, 1], ">i4").tobytes())
    inside += element(1, b"x") + element(9, values.astype(">f8").tobytes())
    header = b"MATLAB 5.0 MAT-file, by hand".ljust(124) + b"\1\0MI"
    (tmp_path / "big.mat").write_bytes(header + element(14, inside))
    np.testing.assert_array_equal(read_file(tmp_path / "big.mat").column("x").values, values)


def test_every_cut_of_a_matlab_file_is_a_sentence_or_whole_variables(tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "whole.mat", {"a": FREQUENCY, "s": {"b": H, "t": "text"}})
    data, path = (tmp_path / "whole.mat").read_bytes(), tmp_path / "cut.mat"
    first = 128 + 8 + int.from_bytes(data[132:136], "little")
    for length in range(1, len(data)):
        path.write_bytes(data[:length])
        if length == first:
            assert list(named(read_file(path))) == ["a"]
        else:
            with pytest.raises(CampaignError, match=r"^cut\.mat[^\n]*$"):
                read_file(path)


def matlab_73(path: Path) -> None:
    """What MATLAB writes by save -v7.3, with the axes of arrays in the opposite order."""

    def array(group: Any, name: str, values: Any, kind: bytes = b"double") -> Any:
        dataset = group.create_dataset(name, data=np.atleast_2d(values).T)
        dataset.attrs["MATLAB_class"] = np.bytes_(kind)
        return dataset

    pairs = np.dtype([("real", "f8"), ("imag", "f8")])
    with h5py.File(path, "w", userblock_size=512) as file:
        hidden = file.create_group("#refs#")
        array(file, "H", np.stack([H.real, H.imag], -1).copy().view(pairs)[..., 0])
        array(file, "title", np.array([[ord(letter) for letter in "beam"]], dtype=np.uint16), b"char")
        structure = hidden.create_group("a")
        structure.attrs["MATLAB_class"] = np.bytes_(b"struct")
        array(structure, "freq", FREQUENCY)
        cell = file.create_dataset("FRF", data=np.array([[structure.ref]], dtype=h5py.ref_dtype))
        cell.attrs["MATLAB_class"] = np.bytes_(b"cell")
        runs = file.create_group("runs")
        runs.attrs["MATLAB_class"] = np.bytes_(b"struct")
        levels = [array(hidden, "b", 1.0), array(hidden, "c", 2.0)]
        runs.create_dataset("level", data=np.array([[level.ref] for level in levels], dtype=h5py.ref_dtype))
        empty = file.create_dataset("empty", data=np.array([0, 3], dtype=np.uint64))
        empty.attrs["MATLAB_class"] = np.bytes_(b"double")
        empty.attrs["MATLAB_empty"] = 1
        file.create_group("sparse").attrs["MATLAB_sparse"] = 5
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, by hand".ljust(124) + b"\0\2IM")


def test_version_7_3_has_the_names_of_matlab_too(tmp_path: Path) -> None:
    matlab_73(tmp_path / "new.mat")
    measured = read_file(tmp_path / "new.mat")
    columns = named(measured)
    assert measured.format == "matlab 7.3"
    np.testing.assert_array_equal(columns["H(:,2)"], H[:, 1])
    np.testing.assert_array_equal(columns["FRF{1}.freq"], FREQUENCY)
    np.testing.assert_array_equal([columns["runs(1).level"], columns["runs(2).level"]], [[1], [2]])
    assert measured.facts["title"] == "beam"
    assert measured.facts["empty"] == "empty"
    assert measured.facts["sparse"] == "not read: a sparse matrix"


def test_hdf5_arrays_texts_attributes_and_links(tmp_path: Path) -> None:
    path = tmp_path / "tree.h5"
    with h5py.File(path, "w") as file:
        file.attrs["title"] = "beam"
        group = file.create_group("run")
        group.attrs["rate"] = 1000
        acc = group.create_dataset("acc", data=np.arange(30.0).reshape(3, 10))
        acc.attrs["unit"] = "m/s²"
        group["H"] = H
        group["sweep"] = ["up", "down", "up"]
        group["note"] = "text"
        group["table"] = np.array([(1, 2.0), (3, 4.0)], dtype=[("n", "i4"), ("v", "f8")])
        group["loop"] = group
        group["empty"] = np.zeros(0)
        group["null"] = h5py.Empty("f8")
        group["reference"] = np.array([acc.ref], dtype=h5py.ref_dtype)
        group["broken"] = h5py.SoftLink("/nowhere")
        group["outside"] = h5py.ExternalLink("other.h5", "/")
        group.create_dataset("ragged", shape=(2,), dtype=h5py.vlen_dtype("f8"))
    measured = read_file(path)
    columns = named(measured)
    np.testing.assert_array_equal(columns["run/acc[2]"], np.arange(20.0, 30.0))
    np.testing.assert_array_equal(columns["run/H[1]"], H[:, 1])
    np.testing.assert_array_equal(columns["run/table/v"], [2, 4])
    assert measured.column("run/sweep").words == ("up", "down")
    assert measured.column("run/acc[0]").unit == "m/s^2"
    assert measured.column("run/acc[0]").facts["rate"] == "1000"
    assert measured.title == "beam"
    assert measured.facts["run/note"] == "text"
    for name in ("reference", "broken", "outside", "ragged"):
        assert measured.facts[f"run/{name}"].startswith("not read")


@pytest.mark.parametrize("name", ["data.mat", "data.h5"])
def test_another_content_than_the_suffix_says_is_recognised_or_refused(tmp_path: Path, name: str) -> None:
    scipy.io.savemat(tmp_path / "real.mat", {"x": FREQUENCY})
    (tmp_path / name).write_bytes((tmp_path / "real.mat").read_bytes())
    assert read_file(tmp_path / name).format == "matlab 5"
    (tmp_path / name).write_text("x,y\n1,2\n")
    with pytest.raises(CampaignError, match=r"MATLAB file of version 5|is damaged"):
        read_file(tmp_path / name)


def test_an_array_that_claims_more_than_the_file_can_have_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "huge.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("x", shape=(10**12,), dtype="f8", chunks=(1000,))
    with pytest.raises(CampaignError, match=r"huge\.h5: .*GB"):
        read_file(path)
