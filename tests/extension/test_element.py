"""A wedge of fifteen nodes, added by one file outside the product, passes what every element must.

Every test of the package `fe` that takes the fixture `element` is such a test: it is run here for the wedge as well.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from casefile.errors import CaseError
from fe.element import ELEMENTS, HEX20, REGISTRY, TET10, Element
from fe.errors import MeshError
from fe.face_integral import find_outer_faces, integrate_volume
from fe.file.mesh_file import read_mesh, write_mesh
from fe.mesh import Mesh
from fe.mesher.block import Block, mesh_blocks
from fe.modal import modes
from figure.scene.skin import make_skin
from geometry.errors import RegistryError
from study.kind.blade.model import clamped, make_blade_model
from study.kind.registry import open_case
from study.shipped_cases import BLADE
from tests.extension.sweep import sweeps
from tests.fe import (
    conftest,
    test_assembly,
    test_calculix_witness,
    test_convergence,
    test_free_modes,
    test_mesh,
    test_mesh_quality,
    test_patch,
    test_pressed_disc,
    test_solid,
    test_station_coordinates,
    test_stress,
)
from tests.fe.element import test_element
from tests.fe.file import test_mesh_file
from tests.fe.mesher import test_whole_mesh

WEDGE = Path(__file__).with_name("wedge15.py")
BoxMesher = Callable[..., Mesh]
Uvw = NDArray[np.float64]

box = conftest.box
mesh_suffix = test_mesh_file.mesh_suffix


@pytest.fixture(scope="module")
def element() -> Iterator[Element]:
    """The wedge; the other tests of this process do without it."""
    (wedge,) = REGISTRY.load(WEDGE)
    yield wedge
    REGISTRY.forget(WEDGE)


globals().update(
    sweeps(
        "element",
        test_assembly,
        test_convergence,
        test_element,
        test_free_modes,
        test_mesh,
        test_mesh_file,
        test_mesh_quality,
        test_patch,
        test_pressed_disc,
        test_solid,
        test_station_coordinates,
        test_stress,
        test_whole_mesh,
    )
)


@pytest.mark.calculix
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.skipif(*test_calculix_witness.pytestmark[1].args, **test_calculix_witness.pytestmark[1].kwargs)
def test_mass_and_stiffness_of_one_distorted_cell_are_those_of_calculix(element: Element, seed: int) -> None:
    test_calculix_witness.test_mass_and_stiffness_of_one_distorted_cell_agree(element, seed)


@pytest.mark.calculix
@pytest.mark.parametrize("body", [test_calculix_witness.distorted_block, test_calculix_witness.plain_blade])
@pytest.mark.skipif(*test_calculix_witness.pytestmark[1].args, **test_calculix_witness.pytestmark[1].kwargs)
def test_frequencies_are_those_of_calculix(body: Callable[..., Mesh], element: Element, box: BoxMesher) -> None:
    test_calculix_witness.test_matrices_and_the_first_ten_frequencies_of_two_materials_agree(body, element, box)


def test_labels_of_faces_name_the_nodes_of_the_manual(element: Element) -> None:
    # CalculiX CrunchiX User's Manual 2.20, "Six-node wedge element": faces S1 to S5 by their corners, from 1.
    manual = [(1, 2, 3), (4, 5, 6), (1, 2, 5, 4), (2, 3, 6, 5), (3, 1, 4, 6)]
    for corners, local in zip(manual, element.abaqus_faces, strict=True):
        assert {node + 1 for node in element.corner_faces[local]} == {*corners}


def test_nastran_bulk_data_are_read_in_its_order(element: Element, tmp_path: Path) -> None:
    # CPENTA (Quick Reference Guide): edges of the first triangle, then the upright ones, then those of the second.
    order = [*range(9), 12, 13, 14, 9, 10, 11]
    points = (element.nodes + np.array([0.0, 0.0, 1.0])) * [2.0, 3.0, 5.0]
    grid = "".join(f"GRID,{k},,{x:.1f},{y:.1f},{z:.1f}\n" for k, (x, y, z) in enumerate(points[order], 1))
    card = "CPENTA,1,1,1,2,3,4,5,6,+\n+,7,8,9,10,11,12,13,14,+\n+,15\n"
    (tmp_path / "one.bdf").write_text(f"BEGIN BULK\n{grid}{card}ENDDATA\n")
    read = read_mesh(tmp_path / "one.bdf")
    np.testing.assert_allclose(read.points[read.cells["wedge15"][0]], points)


def test_bricks_and_wedges_that_share_their_sides_are_one_mesh(element: Element, tmp_path: Path) -> None:
    mixed = joined(HEX20, element)
    write_mesh(mixed, tmp_path / "mixed.vtu")
    read = read_mesh(tmp_path / "mixed.vtu")
    assert integrate_volume(read) == pytest.approx(2, rel=1e-12)
    # Six sides a brick, the one between them inside; the wedges stand on triangles, two a brick.
    assert len(find_outer_faces(read)) == 5 + 5 + 2


def test_tetrahedra_against_the_sides_of_wedges_are_refused(element: Element, tmp_path: Path) -> None:
    write_mesh(joined(TET10, element), tmp_path / "mixed.vtu")
    with pytest.raises(MeshError, match=r"joins tetra10 and wedge15 cells at 8 nodes.* remesh"):
        read_mesh(tmp_path / "mixed.vtu")


def joined(first: Element, second: Element) -> Mesh:
    """Two unit cubes beside each other, each in cells of its own, one set of nodes where they touch."""

    def cube(element: Element, shift: float) -> Mesh:
        def shape(u: Uvw, v: Uvw, w: Uvw) -> tuple[Uvw, Uvw, Uvw]:
            return u + shift, v, w

        return mesh_blocks([Block(shape=shape, counts=(1, 1, 1))], element)

    left, right = cube(first, 0.0), cube(second, 1.0)
    points, which = np.unique(np.vstack([left.points, right.points]).round(12), axis=0, return_inverse=True)
    cells = {
        first.cell_type: left.cells[first.cell_type],
        second.cell_type: right.cells[second.cell_type] + left.n_node,
    }
    return Mesh(points=points, cells={cell_type: which.ravel()[nodes] for cell_type, nodes in cells.items()})


def test_its_skin_is_closed_and_curved_and_its_edges_are_drawn_once(element: Element, box: BoxMesher) -> None:
    mesh = box(element, counts=(2, 1, 6))
    skin = make_skin(mesh)
    points, normals = skin.sample @ mesh.points, skin.normals(mesh.points)
    assert ((points - mesh.points.mean(axis=0)) * normals).sum(axis=1).min() > 0
    # Four sides of 6 or 12 quadrilaterals, two ends of 4 triangles; each edge belongs to two faces.
    assert len(skin.edges) == (2 * (6 + 12) * 4 + 2 * 4 * 3) / 2
    assert skin.is_feature.sum() == 4 * (2 + 1 + 6)


def test_a_case_file_names_it_and_the_blade_is_meshed_with_it(element: Element, tmp_path: Path) -> None:
    text = BLADE.read_text(encoding="utf-8").replace("elements_through_thickness = 2", "elements_through_thickness = 1")
    result = {}
    for name in ("hex20", element.name):
        (tmp_path / "blade.toml").write_text(text.replace('"hex20"', f'"{name}"'), encoding="utf-8")
        case = open_case(tmp_path / "blade.toml").case
        table = case.structure
        model = make_blade_model(case, table, "structure", element=table.mesh.element, through_thickness=1)
        mesh, system, _ = clamped(model)
        assert [ELEMENTS[cell_type].name for cell_type in mesh.cells] == [name]
        result[name] = integrate_volume(mesh), modes(system, 3).frequency
    (volume, bricks), (filled, wedges) = result.values()
    assert filled == pytest.approx(volume, rel=1e-12)  # the faces are the same
    # Two meshes of one size and degree: 1.0e-4 to 1.8e-4 apart were measured.
    np.testing.assert_allclose(wedges, bricks, rtol=3e-4)


def test_a_case_file_that_names_none_is_answered_with_those_that_there_are(element: Element, tmp_path: Path) -> None:
    (tmp_path / "blade.toml").write_text(BLADE.read_text(encoding="utf-8").replace('"hex20"', '"wedge16"'))
    with pytest.raises(CaseError, match=r'mesh\.element = "wedge16": .*"hex20".*"wedge15".*did you mean "wedge15"'):
        open_case(tmp_path / "blade.toml")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"gmsh_order": tuple(range(14))}, "has 15 nodes, but gmsh_order"),
        ({"abaqus_faces": (0, 1, 2, 3, 3)}, "has 5 faces, but abaqus_faces"),
        ({"faces": ((0, 1, 2, 6, 7, 8),)}, "has faces that do not enclose it"),
        ({"gradient": lambda points: HEX20.gradient(points)[:, :15]}, "gradient that is not the derivative"),
        ({"shape": lambda points: HEX20.shape(points)[:, :15]}, "shape functions that are not 1 at their own node"),
        ({"from_brick": HEX20.from_brick}, "from_brick makes cells of 20"),
        ({"cell_type": "tetra10"}, 'cell_type "tetra10" of another element'),
        ({"name": "hex20"}, '"hex20" is already registered'),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_a_table_that_contradicts_itself_is_refused(element: Element, change: dict[str, object], message: str) -> None:
    spoilt = replace(element, **{"name": "spoilt", "cell_type": "wedge18", **change})
    with pytest.raises(RegistryError, match=message):
        REGISTRY.register(spoilt)
    assert "spoilt" not in REGISTRY
    assert ELEMENTS["wedge15"] is element


def test_cells_that_overlap_in_a_brick_are_refused(element: Element) -> None:
    def twice(bricks: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        brick, places = element.from_brick(bricks)
        return np.tile(brick, 2), np.tile(places, (2, 1))

    with pytest.raises(RegistryError, match="fills 2 of a brick"):
        REGISTRY.register(replace(element, name="spoilt", cell_type="wedge18", from_brick=twice))


def test_a_table_that_lacks_a_fact_is_refused_by_file_and_name_of_the_fact(tmp_path: Path) -> None:
    text = WEDGE.read_text()
    lines = [line for line in text.splitlines() if "regular_corner=" not in line]
    (tmp_path / "wedge.py").write_text("\n".join(lines))
    with pytest.raises(RegistryError, match=r"wedge\.py, line \d+: .*regular_corner"):
        REGISTRY.load(tmp_path / "wedge.py")
