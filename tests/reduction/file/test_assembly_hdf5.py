"""A reduced assembly as a file: nothing lost, nothing damaged or of another kind accepted."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from reduction.assembly import ReducedAssembly
from reduction.errors import RomError
from reduction.file.rom_hdf5 import load_assembly, load_rom, save_assembly, save_rom
from reduction.rom import ReducedModel


def body(seed: int, n: int) -> ReducedModel:
    rng = np.random.default_rng(seed)
    roots = {name: rng.standard_normal((n, n)) for name in ("mass", "damping", "stiffness")}
    return ReducedModel(
        **{name: root @ root.T + np.eye(n) for name, root in roots.items()},
        boundary_node=np.array([1]),
        boundary_direction=np.array([1]),
        boundary_sets={"contact": np.array([0])},
        fixed_interface_frequency=np.arange(1.0, n),
        recovery=rng.standard_normal((6, n)),
        free=np.arange(6),
        n_node=2,
        provenance={"seed": str(seed)},
    )


@pytest.fixture
def assembly() -> ReducedAssembly:
    # Not in the order of their names, and one that HDF5 takes for a path.
    return ReducedAssembly(bodies={"wheel": body(1, 4), "blade": body(2, 3), "left/damper": body(3, 5)})


def test_nothing_is_lost(assembly: ReducedAssembly, tmp_path: Path) -> None:
    save_assembly(assembly, tmp_path / "rig.h5")
    result = load_assembly(tmp_path / "rig.h5")
    assert list(result.bodies) == list(assembly.bodies)
    for name in ("mass", "damping", "stiffness"):
        np.testing.assert_array_equal(getattr(result, name), getattr(assembly, name))
    for name, rom in assembly.bodies.items():
        np.testing.assert_array_equal(result.bodies[name].recovery, rom.recovery)
        assert result.bodies[name].provenance == rom.provenance
    np.testing.assert_array_equal(result.rows("left/damper", "contact"), [7])


def test_a_single_model_is_no_assembly_and_the_other_way_round(assembly: ReducedAssembly, tmp_path: Path) -> None:
    save_rom(body(1, 4), tmp_path / "rom.h5")
    save_assembly(assembly, tmp_path / "rig.h5")
    with pytest.raises(RomError, match=r'rom\.h5" is an HDF5 file but not a stickslip reduced assembly'):
        load_assembly(tmp_path / "rom.h5")
    with pytest.raises(RomError, match=r'rig\.h5" is an HDF5 file but not a stickslip reduced model'):
        load_rom(tmp_path / "rig.h5")


def test_a_changed_number_in_one_body_is_refused(assembly: ReducedAssembly, tmp_path: Path) -> None:
    save_assembly(assembly, tmp_path / "rig.h5")
    with h5py.File(tmp_path / "rig.h5", "r+") as file:
        file["bodies/000001/mass"][0, 0] += 1e-12
    with pytest.raises(RomError, match="do not match their checksum"):
        load_assembly(tmp_path / "rig.h5")


def test_a_missing_body_is_refused(assembly: ReducedAssembly, tmp_path: Path) -> None:
    save_assembly(assembly, tmp_path / "rig.h5")
    with h5py.File(tmp_path / "rig.h5", "r+") as file:
        del file["bodies/000001"]
    with pytest.raises(RomError, match="do not match their checksum"):
        load_assembly(tmp_path / "rig.h5")
