"""HDF5 files that end their library or keep it for ever are found before this process opens them."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from correlation.errors import CampaignError
from correlation.file.read_file import read_file
from fe.file.hdf5_file import find_unsafe_hdf5_content
from hbsolve.errors import BalanceError
from hbsolve.limits.result import load_limits
from reduction.errors import RomError
from reduction.file.rom_hdf5 import load_assembly, load_rom


def with_looping_group(path: Path) -> None:
    """A file whose root group is found again in itself: its B-tree's left child is its own node, for ever."""
    with h5py.File(path, "w", libver="earliest") as file:
        for number in range(40):
            file.create_dataset(f"array {number}", data=np.arange(3.0))
            file.attrs[f"attribute {number}"] = number
    data = bytearray(path.read_bytes())
    place = data.find(b"TREE")
    size = 8
    own = place.to_bytes(size, "little")
    # Signature, type, level and number of entries; then the addresses of the siblings, key and child.
    data[place + 5] = 1
    data[place + 8 + 3 * size : place + 8 + 4 * size] = own
    path.write_bytes(data)


def test_a_group_that_is_found_in_itself_is_a_trap(tmp_path: Path) -> None:
    with_looping_group(tmp_path / "a.h5")
    assert find_unsafe_hdf5_content(tmp_path / "a.h5") is not None
    with pytest.raises(CampaignError, match=r"a\.h5"):
        read_file(tmp_path / "a.h5")


def test_sound_files_are_no_trap(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        group = file.create_group("run")
        group["acc"] = np.arange(5.0)
        group["again"] = h5py.SoftLink("/run")
        group["elsewhere"] = h5py.ExternalLink("/dev/zero", "/x")
        group["reference"] = np.array([group.ref], dtype=h5py.ref_dtype)
        file.attrs["unit"] = "m"
    assert find_unsafe_hdf5_content(tmp_path / "a.h5") is None
    (tmp_path / "text.h5").write_text("no")
    assert find_unsafe_hdf5_content(tmp_path / "text.h5") is None


def test_a_text_that_is_longer_than_any_memory_is_a_trap(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["text"] = "provenance" * 20
        place = file["text"].id.get_offset()
    data = bytearray((tmp_path / "a.h5").read_bytes())
    assert int.from_bytes(data[place : place + 4], "little") == 200  # length, before the place of the letters
    data[place : place + 4] = (3_000_000_000).to_bytes(4, "little")
    (tmp_path / "a.h5").write_bytes(data)
    assert "GB" in str(find_unsafe_hdf5_content(tmp_path / "a.h5"))


def test_every_reader_refuses_a_file_that_is_a_trap(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["x"] = np.arange(3.0)
    for module in ("reduction.file.rom_hdf5", "hbsolve.netcdf", "correlation.file.arrays.hdf5_tree"):
        monkeypatch.setattr(f"{module}.find_unsafe_hdf5_content", lambda _: "ends its reader (SIGSEGV)")
    for read, error in (
        (load_rom, RomError), (load_assembly, RomError), (load_limits, BalanceError), (read_file, CampaignError)
    ):  # fmt: skip
        with pytest.raises(error, match=r"a\.h5.*ends its reader"):
            read(tmp_path / "a.h5")
