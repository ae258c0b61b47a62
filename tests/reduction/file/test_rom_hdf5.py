"""A reduced model as a file: nothing lost, nothing damaged accepted."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from reduction.assembly import ReducedAssembly
from reduction.errors import RomError
from reduction.file.rom_hdf5 import load_assembly, load_rom, save_assembly, save_rom
from reduction.rom import ReducedModel

ARRAYS = (
    "mass",
    "damping",
    "stiffness",
    "fixed_interface_frequency",
    "recovery",
    "boundary_node",
    "boundary_direction",
    "free",
)


def model(**changed: Any) -> ReducedModel:
    rng = np.random.default_rng(0)
    root = rng.standard_normal((5, 5))
    whole: dict[str, Any] = {
        "mass": root @ root.T + np.eye(5),
        "damping": 0.1 * root @ root.T,
        "stiffness": root.T @ root,
        "boundary_node": np.array([3, 3, 1]),
        "boundary_direction": np.array([1, 2, 1]),
        "boundary_sets": {"slot left/upper": np.array([2, 0]), "Spitze äöü": np.array([0, 1]), ".": np.array([1])},
        "fixed_interface_frequency": np.array([1.0, np.pi]),
        "recovery": rng.standard_normal((9, 5)),
        "free": np.arange(3, 12),
        "n_node": 4,
        # Longer than an HDF5 attribute may be.
        "provenance": {"case": "[blade]\n" * 10_000, "Prüfer": "µm", "a/b": ""},
    }
    return ReducedModel(**whole | changed)


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    path = tmp_path / "blade.rom.h5"
    save_rom(model(), path)
    return path


def test_a_round_trip_changes_no_bit(saved: Path) -> None:
    rom, again = model(), load_rom(saved)
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(again, name), getattr(rom, name))
        assert getattr(again, name).dtype == getattr(rom, name).dtype
    assert list(again.boundary_sets) == list(rom.boundary_sets)
    for name, rows in rom.boundary_sets.items():
        np.testing.assert_array_equal(again.boundary_sets[name], rows)
    assert again.provenance == rom.provenance
    assert again.n_node == 4


def test_a_model_without_boundary_or_modes_survives(tmp_path: Path) -> None:
    empty = ReducedModel(
        mass=np.eye(1),
        damping=np.eye(1),
        stiffness=np.eye(1),
        boundary_node=np.array([], dtype=np.int64),
        boundary_direction=np.array([], dtype=np.int64),
        boundary_sets={},
        fixed_interface_frequency=np.array([2.0]),
        recovery=np.ones((3, 1)),
        free=np.arange(3),
        n_node=1,
    )
    save_rom(empty, tmp_path / "rom.h5")
    assert load_rom(tmp_path / "rom.h5").boundary_node.shape == (0,)


def test_a_file_cut_short_anywhere_is_refused(saved: Path) -> None:
    whole = saved.read_bytes()
    rng = np.random.default_rng(0)
    for length in [0, 1, 7, 8, 95, 96, 512, len(whole) - 1, *rng.integers(0, len(whole), 4)]:
        saved.write_bytes(whole[:length])
        with pytest.raises(RomError, match=f"\\({length} bytes\\) is truncated, damaged or not an HDF5 file"):
            load_rom(saved)


def test_a_damaged_byte_is_noticed_or_harmless(saved: Path) -> None:
    whole, rom = saved.read_bytes(), model()
    refused = 0
    for place in np.random.default_rng(1).integers(0, len(whole), 30):
        saved.write_bytes(whole[:place] + bytes([whole[place] ^ 0x5A]) + whole[place + 1 :])
        try:
            again = load_rom(saved)
        except RomError:
            refused += 1
        else:  # a byte that HDF5 does not use
            assert all(np.array_equal(getattr(again, name), getattr(rom, name)) for name in ARRAYS)
    assert refused > 10  # most of the file is contents


def test_damaged_numbers_are_named_as_such(saved: Path) -> None:
    with h5py.File(saved, "r+") as file:
        file["stiffness"][2, 3] += 1e-12
    with pytest.raises(RomError, match=r"blade\.rom\.h5\" is damaged, its contents do not match their checksum"):
        load_rom(saved)


def spoilt(name: str, place: tuple[int, ...], value: float) -> np.ndarray:
    other = getattr(model(), name).copy()
    other[place] = value
    return other


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("damping", spoilt("damping", (0, 1), np.nan), r"damping holds nan at \(0, 1\): give finite numbers"),
        ("recovery", spoilt("recovery", (2, 3), np.inf), r"recovery holds inf at \(2, 3\)"),
        (
            "stiffness",
            spoilt("stiffness", (0, 1), 9.0),
            r"stiffness is not symmetric: entries \(0, 1\) and \(1, 0\) are 9",
        ),
        ("mass", -model().mass, "mass is not positive definite: check its units"),
        ("boundary_sets", {"tip": np.array([3])}, '"tip" names row 3, but there are 0 to 2'),
        ("boundary_node", np.array([3, 99, 1]), "boundary_node holds 99, but there are 0 to 3"),
        ("boundary_direction", np.array([1, 3, 1]), "boundary_direction holds 3, but there are 0 to 2"),
        ("free", np.arange(4, 13), "free holds 12, but there are 0 to 11"),
        ("n_node", 3, "boundary_node holds 3, but there are 0 to 2"),
    ],
)
def test_a_whole_file_of_what_is_no_model_is_refused_with_file_and_body(
    tmp_path: Path, name: str, value: Any, message: str
) -> None:
    wrong = model(**{name: value})  # its checksum is right
    save_rom(wrong, tmp_path / "rom.h5")
    with pytest.raises(RomError, match=rf'rom\.h5": .*{message}'):
        load_rom(tmp_path / "rom.h5")
    save_assembly(ReducedAssembly(bodies={"blade": model(), "damper": wrong}), tmp_path / "rig.h5")
    with pytest.raises(RomError, match=rf'rig\.h5", body "damper": .*{message}'):
        load_assembly(tmp_path / "rig.h5")


def test_another_version_is_refused_with_both_versions(saved: Path) -> None:
    with h5py.File(saved, "r+") as file:
        file.attrs["format_version"] = 7
    with pytest.raises(RomError, match=r"has format version 7, but this stickslip reads version 1"):
        load_rom(saved)


def test_other_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(RomError, match=r'there is no reduced model ".*missing\.h5"'):
        load_rom(tmp_path / "missing.h5")
    with pytest.raises(RomError, match="there is no reduced model"):
        load_rom(tmp_path)
    (tmp_path / "notes.txt").write_text("not a model")
    with pytest.raises(RomError, match=r"\(11 bytes\) is truncated, damaged or not an HDF5 file"):
        load_rom(tmp_path / "notes.txt")
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file["mass"] = np.eye(2)
    with pytest.raises(RomError, match=r"other\.h5\" is an HDF5 file but not a stickslip reduced model"):
        load_rom(tmp_path / "other.h5")


def test_a_folder_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RomError, match=r'there is no folder ".*nowhere", create it first'):
        save_rom(model(), tmp_path / "nowhere" / "rom.h5")
    (tmp_path / "folder.h5").mkdir()
    with pytest.raises(RomError, match=r"folder\.h5\" cannot be written \(Is a directory\)"):
        save_rom(model(), tmp_path / "folder.h5")
    # Root may write anywhere but here.
    with pytest.raises(RomError, match=r"cannot be written"):
        save_rom(model(), Path("/proc/rom.h5"))
    assert [path.name for path in tmp_path.iterdir()] == ["folder.h5"]


def test_a_failed_write_leaves_the_old_file_alone(saved: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = saved.read_bytes()

    def full_disk(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(h5py.File, "create_dataset", full_disk)
    with pytest.raises(RomError, match="No space left on device"):
        save_rom(model(), saved)
    assert saved.read_bytes() == before
    assert [path.name for path in saved.parent.iterdir()] == [saved.name]
