"""CalculiX, an independent code, must see the same body: element matrices and frequencies on the same mesh."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.typing import NDArray

from fe.assembly import assemble
from fe.boundary import Support, supported_system
from fe.calculix_run import find_ccx, run_frequency, run_matrices
from fe.element import HEX8, HEX20, Element
from fe.errors import MeshError
from fe.file.calculix_deck import FrequencyOutput, write_calculix
from fe.material import STEEL, Material
from fe.mesh import Mesh
from fe.mesher.blade import PadMesh, mesh_blade
from fe.mesher.block import Block, mesh_blocks
from fe.mesher.mesh_rule import MeshRule
from fe.modal import modes
from geometry.blade import Blade
from geometry.errors import InputError

BOTH = pytest.mark.parametrize("element", [HEX8, HEX20], ids=lambda element: element.name)
WITNESS = pytest.mark.skipif(find_ccx() is None, reason="CalculiX is not installed: apt-get install calculix-ccx")
# The deck holds 13 digits of coordinates and CalculiX writes 14 digits of matrices: what is left is their round-off.
DECK_DIGITS = 1e-10
# Frequencies amplify that by the condition of the stiffness, near 1e5 here.
FREQUENCY = 1e-8
ALUMINIUM = Material(young=70e9, poisson=0.33, density=2700.0)


def bent_bar(element: Element) -> Mesh:
    """A bar of 12 unequal, curved cells, in two halves."""

    def shape(
        u: NDArray[np.float64], v: NDArray[np.float64], w: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        z = 0.1 * w**1.2
        return 0.02 * u**1.1 + 0.5 * z**2, 0.01 * v * (1 + 3 * z) + 0.004 * np.sin(20 * z + u), z

    faces = {"w0": "foot"}
    mesh = mesh_blocks([Block(shape=shape, counts=(2, 1, 6), faces=faces)], element)
    low = np.flatnonzero(mesh.points[next(iter(mesh.cells.values()))].mean(axis=1)[:, 2] < 0.05)
    return replace(mesh, cell_sets={"low": low, "high": np.setdiff1d(np.arange(mesh.n_cell), low)})


def relative_difference(ours: sp.csr_array, theirs: sp.csr_array) -> float:
    return float(abs(ours - theirs).max() / abs(theirs).max())


def fixed_dofs(nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.column_stack([np.repeat(nodes, 3), np.tile([0, 1, 2], len(nodes))])


@WITNESS
@BOTH
def test_matrices_of_one_distorted_cell_agree(element: Element) -> None:
    size = np.array([0.01, 0.02, 0.03])
    noise = np.random.default_rng(11).uniform(-0.05, 0.05, (element.n_node, 3))
    mesh = Mesh(points=(element.nodes + noise) * size, cells={element.cell_type: np.arange(element.n_node)[None]})
    mass, stiffness = assemble(mesh, STEEL)
    their_mass, their_stiffness = run_matrices(mesh, STEEL)
    assert relative_difference(mass, their_mass) < DECK_DIGITS
    assert relative_difference(stiffness, their_stiffness) < DECK_DIGITS


@WITNESS
@BOTH
def test_matrices_of_a_curved_mesh_of_two_materials_agree(element: Element) -> None:
    mesh = bent_bar(element)
    materials = {"low": STEEL, "high": ALUMINIUM}
    mass, stiffness = assemble(mesh, materials)
    their_mass, their_stiffness = run_matrices(mesh, materials)
    assert relative_difference(mass, their_mass) < DECK_DIGITS
    assert relative_difference(stiffness, their_stiffness) < DECK_DIGITS


@WITNESS
@BOTH
def test_the_first_ten_frequencies_agree(element: Element) -> None:
    mesh = bent_bar(element)
    materials = {"low": STEEL, "high": ALUMINIUM}
    foot = mesh.nodes("foot")
    system = supported_system(mesh, *assemble(mesh, materials), [Support(nodes=foot)])
    theirs = run_frequency(mesh, materials, fixed_dofs(foot), 10)
    np.testing.assert_allclose(modes(system, 10).frequency, theirs, rtol=FREQUENCY)


@WITNESS
@BOTH
def test_the_slotted_blade_agrees(element: Element) -> None:
    rule = MeshRule(element=element, through_thickness=1, length_ratio=2.4, length_cap=0.02)
    mesh = mesh_blade(Blade(), rule, PadMesh(across_groove=2, across_lip=1, above_groove=2, band=1))
    clamp = mesh.nodes("clamp")
    mass, stiffness = assemble(mesh, STEEL)
    their_mass, their_stiffness = run_matrices(mesh, STEEL)
    assert relative_difference(mass, their_mass) < DECK_DIGITS
    assert relative_difference(stiffness, their_stiffness) < DECK_DIGITS
    ours = modes(supported_system(mesh, mass, stiffness, [Support(nodes=clamp)]), 10).frequency
    np.testing.assert_allclose(ours, run_frequency(mesh, STEEL, fixed_dofs(clamp), 10), rtol=FREQUENCY)


@WITNESS
def test_a_support_in_one_direction_holds_only_that(tmp_path: Path) -> None:
    mesh = bent_bar(HEX8)
    foot = mesh.nodes("foot")
    supports = [Support(nodes=foot, directions=(2,)), Support(nodes=foot[:3], directions=(0, 1))]
    fixed = np.array([(node, 2) for node in foot] + [(node, axis) for node in foot[:3] for axis in (0, 1)])
    system = supported_system(mesh, *assemble(mesh, STEEL), supports)
    np.testing.assert_allclose(modes(system, 5).frequency, run_frequency(mesh, STEEL, fixed, 5), rtol=FREQUENCY)


@WITNESS
def test_a_failure_of_calculix_is_quoted() -> None:
    mesh = bent_bar(HEX8)
    # A name that is in the mesh but holds no cell: CalculiX finds cells without material.
    with pytest.raises(InputError, match=r"CalculiX stopped .*ERROR.*check mesh, materials and supports"):
        run_frequency(mesh, {"low": STEEL}, fixed_dofs(mesh.nodes("foot")), 2)


def test_without_calculix_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(os.environ, "PATH", "")
    with pytest.raises(InputError, match="apt-get install calculix-ccx"):
        run_frequency(bent_bar(HEX8), STEEL, np.array([[0, 0]]), 1)


def test_a_deck_names_each_material_and_support_once(tmp_path: Path) -> None:
    mesh = bent_bar(HEX20)
    deck = tmp_path / "bar.inp"
    fixed = np.array([[0, 0], [4, 2]])
    write_calculix(mesh, deck, {"low": STEEL, "high": ALUMINIUM}, fixed, 7, FrequencyOutput.BINARY)
    lines = deck.read_text().splitlines()
    assert "*ELEMENT, TYPE=C3D20" in lines
    assert [line for line in lines if line.startswith("*SOLID SECTION")] == [
        "*SOLID SECTION, ELSET=low, MATERIAL=MATERIAL_1",
        "*SOLID SECTION, ELSET=high, MATERIAL=MATERIAL_2",
    ]
    assert lines[-7:] == ["*BOUNDARY", "1, 1, 1", "5, 3, 3", "*STEP", "*FREQUENCY, STORAGE=YES", "7", "*END STEP"]


def test_a_material_for_an_unknown_set_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match='cell set "middle", but the mesh has high, low'):
        write_calculix(bent_bar(HEX8), tmp_path / "bar.inp", {"middle": STEEL}, np.empty((0, 2)), 1)
