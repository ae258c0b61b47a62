"""A reduced model and plain matrices as .npz: nothing lost on the way, nothing damaged accepted."""

import contextlib
from pathlib import Path
from zipfile import ZIP_DEFLATED

import numpy as np
import pytest

from geometry.errors import InputError
from reduction.errors import ExchangeError, RomError
from reduction.file.npz import write_npz
from reduction.file.rom_npz import load_rom_npz, save_rom_npz
from reduction.file.structure_file import StructureMatrices, load_matrices, save_matrices
from reduction.rom import ReducedModel

ARRAYS = (
    "mass", "damping", "stiffness", "fixed_interface_frequency", "recovery", "boundary_node", "boundary_direction",
    "free",
)  # fmt: skip


RNG = np.random.default_rng(0)


def definite() -> np.ndarray:
    root = RNG.standard_normal((5, 5))
    return root @ root.T + np.eye(5)


M, C, K = definite(), definite(), 1e6 * definite()
RECOVERY = RNG.standard_normal((9, 5))


def model() -> ReducedModel:
    return ReducedModel(
        mass=M,
        damping=C,
        stiffness=K,
        boundary_node=np.array([3, 3, 1]),
        boundary_direction=np.array([1, 2, 1]),
        boundary_sets={"slot left/upper": np.array([2, 0]), "Spitze äöü": np.array([0, 1]), "none": np.zeros(0, int)},
        fixed_interface_frequency=np.array([1.0, np.pi]),
        recovery=RECOVERY,
        free=np.arange(3, 12),
        n_node=4,
        provenance={"case": "[blade]\n" * 1000, "Prüfer": "µm"},
    )


def test_a_reduced_model_comes_back_bit_by_bit(tmp_path: Path) -> None:
    save_rom_npz(model(), tmp_path / "rom.npz")
    for again in (load_rom_npz(tmp_path / "rom.npz"), load_matrices(tmp_path / "rom.npz").rom):
        assert again is not None
        for name in ARRAYS:
            np.testing.assert_array_equal(getattr(again, name), getattr(model(), name))
        assert {name: rows.tolist() for name, rows in again.boundary_sets.items()} == {
            "slot left/upper": [2, 0], "Spitze äöü": [0, 1], "none": []
        }  # fmt: skip
        assert again.provenance == model().provenance
        assert again.n_node == 4


def test_files_hold_the_arrays_of_the_model_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def savez(file: object, *given: object, **arrays: object) -> None:
        raise AssertionError("NumPy before 2.1 would store the keyword allow_pickle as an array")

    monkeypatch.setattr(np, "savez", savez)
    save_rom_npz(model(), tmp_path / "rom.npz")
    save_matrices(StructureMatrices(mass=M, damping=M, stiffness=M), tmp_path / "m.npz")
    with np.load(tmp_path / "rom.npz") as rom, np.load(tmp_path / "m.npz") as plain:
        assert set(rom.files) == {*ARRAYS, "boundary_sets", "provenance", "n_node"}
        assert set(plain.files) == {"mass", "damping", "stiffness"}


def test_numpy_alone_reads_the_matrices(tmp_path: Path) -> None:
    save_rom_npz(model(), tmp_path / "rom.npz")
    with np.load(tmp_path / "rom.npz", allow_pickle=False) as file:
        np.testing.assert_array_equal(file["stiffness"], model().stiffness)


def test_plain_matrices_come_back_bit_by_bit(tmp_path: Path) -> None:
    root = np.random.default_rng(1).standard_normal((4, 4))
    mass, stiffness = root @ root.T + np.eye(4), 1e6 * (root @ root.T + np.eye(4))
    written = StructureMatrices(mass=mass, damping=0.1 * root, stiffness=stiffness)
    save_matrices(written, tmp_path / "m.npz")
    read = load_matrices(tmp_path / "m.npz")
    for name in ("mass", "damping", "stiffness"):
        np.testing.assert_array_equal(getattr(read, name), getattr(written, name))
    assert read.rom is None


def test_a_damaged_an_incomplete_and_a_missing_file_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "rom.npz"
    with pytest.raises(RomError, match="there is no reduced model"):
        load_rom_npz(path)
    save_rom_npz(model(), path)
    path.write_bytes(path.read_bytes()[:-200])
    with pytest.raises(RomError, match=r"truncated, damaged or not an \.npz file"):
        load_rom_npz(path)
    np.savez(path, mass=np.eye(2))
    with pytest.raises(RomError, match="it has no damping"):
        load_rom_npz(path)
    with pytest.raises(ExchangeError, match="create it first"):
        save_rom_npz(model(), tmp_path / "none" / "rom.npz")


def spoilt(matrix: np.ndarray, value: complex) -> np.ndarray:
    other = matrix.astype(complex) if isinstance(value, complex) else matrix.copy()
    other[0, 1] = value
    return other


def test_a_file_damaged_at_any_byte_is_refused_or_read_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "rom.npz"
    write_npz(path, {"M": np.eye(2), "K": np.eye(2), "boundary_sets": "{}"}, ZIP_DEFLATED)
    whole = path.read_bytes()
    for place in range(len(whole)):
        for change in (0x01, 0x08, 0xFF):  # flag of encryption, compression that is not there, anything
            path.write_bytes(whole[:place] + bytes([whole[place] ^ change]) + whole[place + 1 :])
            with contextlib.suppress(InputError):
                load_matrices(path)
            with contextlib.suppress(InputError):
                load_rom_npz(path)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("stiffness", spoilt(K, 1 + 2j), "stiffness holds complex128 instead of real numbers"),
        ("damping", spoilt(C, np.nan), r"damping holds nan at \(0, 1\): give finite numbers"),
        ("recovery", spoilt(RECOVERY, np.inf), r"recovery holds inf at \(0, 1\)"),
        ("stiffness", spoilt(K, 0.0), r"stiffness is not symmetric: entries \(0, 1\) and \(1, 0\) are 0 and"),
        ("mass", -M, "mass is not positive definite"),
        ("boundary_sets", np.array('{"tip": [0.7]}'), r'boundary set "tip" is \[0.7\]: give rows as whole numbers'),
        ("boundary_sets", np.array('{"tip": [true]}'), r'boundary set "tip" is \[True\]'),
        ("boundary_sets", np.array('{"tip": [-1]}'), '"tip" names row -1, but there are 0 to 2'),
        ("boundary_sets", np.array("[0]"), "its boundary_sets are no rows by name"),
        ("boundary_node", np.array([3, 99, 1]), "boundary_node holds 99, but there are 0 to 3"),
        ("boundary_node", np.array([3, 0.5, 1]), "boundary_node holds float64 instead of whole numbers"),
        ("boundary_direction", np.array([1, 3, 1]), "boundary_direction holds 3, but there are 0 to 2"),
        ("free", np.arange(4, 13), "free holds 12, but there are 0 to 11"),
        ("n_node", np.array(4.5), "n_node holds float64 instead of whole numbers"),
        ("n_node", np.array([4, 4]), r"n_node has shape \(2,\)"),
        ("stiffness", np.eye(4), r"stiffness has shape \(4, 4\), but 5 coordinates, 3 of them boundary, need \(5, 5\)"),
        ("recovery", np.ones((8, 5)), r"recovery has shape \(8, 5\)"),
        ("boundary_sets", np.array('{"tip": [3]}'), '"tip" names row 3, but there are 0 to 2'),
    ],
)
def test_arrays_that_do_not_fit_are_refused(tmp_path: Path, name: str, value: np.ndarray, message: str) -> None:
    save_rom_npz(model(), tmp_path / "rom.npz")
    with np.load(tmp_path / "rom.npz") as file:
        content = dict(file)
    np.savez(tmp_path / "rom.npz", **{**content, name: value})
    with pytest.raises(RomError, match=message):
        load_rom_npz(tmp_path / "rom.npz")
