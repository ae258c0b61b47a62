"""The fixed-interface modes of a reduced model are all that there are, or are said not to be."""

from dataclasses import replace

import numpy as np
import pytest

from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.element import HEX8
from fe.material import STEEL
from fe.mesher.block import Block, mesh_blocks
from fe.sparse.symmetric_part import PartView
from fe.system import LinearSystem
from reduction.craig_bampton import craig_bampton
from reduction.errors import RomError
from reduction.rom import ReducedModel
from reduction.rom_error import check_fixed_interface_modes


def square_bar(length: float = 0.2) -> LinearSystem:
    box = Block(
        shape=lambda u, v, w: (length * u, 0.02 * v, 0.02 * w), counts=(16, 4, 4), faces={"u0": "root", "u1": "tip"}
    )
    mesh = mesh_blocks([box], HEX8)
    return supported_system(mesh, *assemble(mesh, STEEL), [Support(nodes=mesh.nodes("root"))])


@pytest.fixture(scope="module")
def bar() -> LinearSystem:
    return square_bar()


def reduced(system: LinearSystem, n_mode: int) -> ReducedModel:
    return craig_bampton(system, {"tip": np.arange(system.n_dof - 75, system.n_dof)}, n_mode)


def test_a_square_bar_keeps_all_its_pairs_of_modes(bar: LinearSystem) -> None:
    check = check_fixed_interface_modes(bar, reduced(bar, 30))
    assert check.n_missed == 0
    assert check.residual.max() < 1e-9  # what block Lanczos promises


def test_a_lost_mode_is_missed(bar: LinearSystem) -> None:
    rom = reduced(bar, 30)
    kept = np.delete(np.arange(rom.n_dof), rom.n_boundary + 1)
    lost = replace(
        rom,
        mass=rom.mass[np.ix_(kept, kept)],
        damping=rom.damping[np.ix_(kept, kept)],
        stiffness=rom.stiffness[np.ix_(kept, kept)],
        fixed_interface_frequency=np.delete(rom.fixed_interface_frequency, 1),
        recovery=rom.recovery[:, kept],
    )
    assert check_fixed_interface_modes(bar, lost).n_missed == 1


def test_what_cannot_be_checked_is_refused(bar: LinearSystem) -> None:
    with pytest.raises(RomError, match="keeps no fixed-interface modes"):
        check_fixed_interface_modes(bar, reduced(bar, 0))
    rom = replace(reduced(bar, 5), free=bar.free + 1)
    with pytest.raises(RomError, match=f"was not made from this system of {bar.n_dof}"):
        check_fixed_interface_modes(bar, rom)


def test_the_part_of_a_matrix_is_what_slicing_gives(bar: LinearSystem) -> None:
    rows = np.setdiff1d(np.arange(bar.n_dof), [0, 5, 100])
    part, sliced = PartView(matrix=bar.stiffness, rows=rows), bar.stiffness[rows][:, rows]
    x = np.random.default_rng(0).standard_normal((len(rows), 3))
    # The products have zeros more to sum, which change nothing.
    np.testing.assert_allclose(part @ x, sliced @ x, rtol=1e-14, atol=1e-14 * abs(sliced).max())
    np.testing.assert_allclose(part @ x[:, 0], sliced @ x[:, 0], rtol=1e-14, atol=1e-14 * abs(sliced).max())
    np.testing.assert_array_equal(part.diagonal(), sliced.diagonal())
    np.testing.assert_array_equal(part.toarray(), sliced.toarray())
    assert part.shape == sliced.shape
