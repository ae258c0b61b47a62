"""Mesh files: what goes out comes back, node orders agree with each format's own manual, and damage is refused."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
from numpy.typing import NDArray

from fe.element import ELEMENTS, HEX8, HEX20, TET10, Element
from fe.errors import InvertedCell, MeshError
from fe.file.mesh import MESH_FORMATS
from fe.file.mesh_file import read_mesh, write_mesh
from fe.file.registry import suffixes
from fe.mesh import Mesh
from fe.mesh_quality import measure_cell_quality
from fe.mesher.block import Block, mesh_blocks
from geometry.errors import InputWarning

# Decks hold 13 digits of coordinates, the other formats all of them.
DIGITS = {".inp": 1e-12, ".msh": 1e-15}


@pytest.fixture(params=suffixes(MESH_FORMATS, written=True))
def mesh_suffix(request: pytest.FixtureRequest) -> str:
    """Each format that is written, in turn: a new one is tested without a word here."""
    return str(request.param)


def bent_bar(element: Element) -> Mesh:
    """A twisted bar of unequal cells: no two of them are alike, so that a node out of place changes a volume."""

    def shape(
        u: NDArray[np.float64], v: NDArray[np.float64], w: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        z = w**1.3 + 0.03 * u * v
        return 0.3 * u**1.2 + 0.1 * z**2, 0.2 * v * (1 + 0.3 * z) + 0.05 * np.sin(2 * z + u), z

    faces = {"u0": "left", "w0": "foot", "w1": "tip"}
    mesh = mesh_blocks([Block(shape=shape, counts=(2, 3, 4), faces=faces)], element)
    line = np.argsort(mesh.points @ [1, 2, 3])[[7, 3, 11, 5]]
    return replace(
        mesh,
        node_sets={"stations": line, "response": np.array([mesh.n_node - 1])},
        # They overlap: a cell may belong to several.
        cell_sets={"steel": np.arange(15), "hot": np.arange(10, mesh.n_cell), "first": np.array([0])},
    )


def volume_of_set(mesh: Mesh, name: str) -> float:
    return float(measure_cell_quality(mesh).volume[mesh.cell_sets[name]].sum())


def face_centres(mesh: Mesh, name: str) -> NDArray[np.float64]:
    cells = next(iter(mesh.cells.values()))
    (element,) = (item for item in ELEMENTS.values() if item.n_node == cells.shape[1])
    corners = [mesh.points[cells[cell, list(element.corner_faces[face])]] for cell, face in mesh.face_sets[name]]
    centres = np.array([corner.mean(axis=0) for corner in corners])
    return centres[np.lexsort(centres.round(9).T)]


def test_a_round_trip_keeps_cells_sets_and_the_order_of_stations(
    element: Element, mesh_suffix: str, tmp_path: Path
) -> None:
    mesh = bent_bar(element)
    write_mesh(mesh, tmp_path / f"bar{mesh_suffix}")
    read = read_mesh(tmp_path / f"bar{mesh_suffix}")
    near = {"rtol": 0, "atol": DIGITS.get(mesh_suffix, 0.0)}
    np.testing.assert_allclose(read.points, mesh.points, **near)
    before, after = mesh.cells[element.cell_type], read.cells[element.cell_type]
    if mesh_suffix == ".msh":
        # Groups there are whole volumes, so that cells come back sorted by the sets they belong to.
        before, after = (cells[np.lexsort(cells.T)] for cells in (before, after))
    np.testing.assert_array_equal(after, before)
    assert {*read.node_sets} == {"stations", "response"}
    assert {*read.cell_sets} == {"steel", "hot", "first"}
    assert {*read.face_sets} == {"left", "foot", "tip"}
    np.testing.assert_array_equal(read.node_sets["stations"], mesh.node_sets["stations"])
    for name in mesh.cell_sets:
        # The sum of a few volumes near 1e-3 may be taken in another order.
        assert volume_of_set(read, name) == pytest.approx(volume_of_set(mesh, name), rel=1e-11)
    for name in mesh.face_sets:
        np.testing.assert_allclose(face_centres(read, name), face_centres(mesh, name), **near)


def test_volume_and_determinant_survive_the_file(mesh_suffix: str, tmp_path: Path) -> None:
    mesh = bent_bar(HEX20)
    write_mesh(mesh, tmp_path / f"bar{mesh_suffix}")
    quality = measure_cell_quality(read_mesh(tmp_path / f"bar{mesh_suffix}"))
    assert quality.determinant_ratio.min() > 0
    np.testing.assert_allclose(np.sort(quality.volume), np.sort(measure_cell_quality(mesh).volume), rtol=1e-11)


def test_a_hexahedron_of_the_gmsh_manual_is_read_in_its_order(tmp_path: Path) -> None:
    # Edges of the manual's drawing "Hexahedron20": node 8 lies between corners 0 and 1, node 9 between 0 and 3, ...
    edges = [(0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7)]
    u, v, w = 2.0, 3.0, 5.0
    corners = np.array([[0, 0, 0], [u, 0, 0], [u, v, 0], [0, v, 0], [0, 0, w], [u, 0, w], [u, v, w], [0, v, w]])
    points = np.vstack([corners, [(corners[a] + corners[b]) / 2 for a, b in edges]])
    lines = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$Nodes", "1 20 1 20", "3 1 0 20"]
    lines += [str(k) for k in range(1, 21)] + [f"{x} {y} {z}" for x, y, z in points]
    lines += ["$EndNodes", "$Elements", "1 1 1 1", "3 1 17 1", " ".join(["1", *(str(k) for k in range(1, 21))])]
    path = tmp_path / "one.msh"
    path.write_text("\n".join([*lines, "$EndElements", ""]))
    read = read_mesh(path)
    np.testing.assert_allclose(
        read.points[read.cells["hexahedron20"][0]], (HEX20.nodes + 1) / 2 * [u, v, w], atol=1e-15
    )
    # Written again, the numbers stand where they stood.
    write_mesh(read, tmp_path / "two.msh")
    assert lines[-1] in (tmp_path / "two.msh").read_text().splitlines()


def test_the_node_order_is_that_of_vtk(element: Element) -> None:
    vtk = pytest.importorskip("vtkmodules.vtkCommonDataModel")
    kinds = {
        "hex8": vtk.vtkHexahedron,
        "hex20": vtk.vtkQuadraticHexahedron,
        "tet10": vtk.vtkQuadraticTetra,
        "wedge15": vtk.vtkQuadraticWedge,
    }
    cell = kinds[element.name]()
    parametric = np.reshape([cell.GetParametricCoords()[k] for k in range(3 * element.n_node)], (-1, 3))
    low, size = element.nodes.min(axis=0), np.ptp(element.nodes, axis=0)
    np.testing.assert_array_equal(parametric, (element.nodes - low) / size)


def write_deck(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


BRICK = """** two unit bricks along x
*Heading
 a deck as another program might write it
*Node, nset=everything
** a comment between keyword and data
 10, 0., 0., 0.
 11, 1., 0., 0.
 12, 1., 1., 0.
 13, 0., 1., 0.
** and one among the data
 14, 0., 0., 1.
 15, 1., 0., 1.
 16, 1., 1., 1.
 17, 0., 1., 1.
 21, 2., 0., 0.
 22, 2., 1., 0.
 25, 2., 0., 1.
 26, 2., 1., 1.
 99, 9., 9., 9.
*element, type=c3d8r, elset=body
 7, 10, 11, 12, 13,
 14, 15, 16, 17
*element, type=C3D8I, elset=BODY
 8, 11, 21, 22, 12, 15, 25, 26, 16
"""


def test_a_deck_of_another_program_is_read(tmp_path: Path) -> None:
    text = (
        BRICK
        + "*elset, elset=last\n 8,\n*elset, elset=both\n last, 7\n*nset, nset=line, generate\n 10, 12, 1\n"
        + "*nset, nset=more\n LINE,\n 26\n*surface, name=ends\n last, S4\n 7, S6\n"
        + "*shell section, elset=skin\n 0.1,\n*element, type=S4, elset=skin\n 30, 10, 11, 15, 14\n"
        + "*material, name=steel\n*elastic\n 210e9, 0.3\n*step\n*end step\n"
    )
    mesh = read_mesh(write_deck(tmp_path / "deck.inp", text))
    assert (mesh.n_node, mesh.n_cell) == (12, 2)
    assert measure_cell_quality(mesh).volume.sum() == pytest.approx(2)
    assert {name: len(cells) for name, cells in mesh.cell_sets.items()} == {"body": 2, "last": 1, "both": 2}
    # Node 99 belongs to no cell: it is gone from the mesh and from its set.
    assert len(mesh.node_sets["everything"]) == 12
    np.testing.assert_array_equal(mesh.points[mesh.nodes("more")][:, 0], [0, 1, 1, 2])
    np.testing.assert_array_equal(np.unique(mesh.points[mesh.nodes("ends")][:, 0]), [0, 2])
    # The shell carries its set to the face under it.
    np.testing.assert_array_equal(mesh.points[mesh.nodes("skin")][:, 1], 0)


def test_lines_of_included_files_stand_where_the_deck_names_them(tmp_path: Path) -> None:
    nodes = BRICK[BRICK.index(" 10, 0.") : BRICK.index("*element")]
    last = BRICK[BRICK.index(" 8, 11, 21") :]
    head = "*element, type=C3D8I, elset=BODY\n"
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "nodes.txt").write_text(nodes)
    (tmp_path / "data" / "last.txt").write_text("*include, input=data/cell.txt\n")
    (tmp_path / "data" / "cell.txt").write_text(last)
    included = BRICK.replace(nodes, "*include, input=data/nodes.txt\n").replace(last, "*INCLUDE, INPUT=data/last.txt\n")
    named = BRICK.replace("*Node,", "*Node, input=data/nodes.txt,").replace(nodes, "")
    for text in (included, named.replace(head + last, head.replace("\n", ", input=data/cell.txt\n"))):
        mesh = read_mesh(write_deck(tmp_path / "deck.inp", text))
        assert (mesh.n_node, mesh.n_cell) == (12, 2)
        assert measure_cell_quality(mesh).volume.sum() == pytest.approx(2)


def test_a_keyword_goes_on_behind_a_comma_and_names_may_have_any_letters(tmp_path: Path) -> None:
    text = BRICK.replace("*element, type=c3d8r, elset=body", "*element, type=c3d8r,\n elset=Körper").replace(
        "*Node, nset=everything", "*Node, nset=everything,"
    )
    for coding in ("utf-8", "latin-1"):
        (tmp_path / "deck.inp").write_bytes(text.encode(coding))
        mesh = read_mesh(tmp_path / "deck.inp")
        assert {name: len(cells) for name, cells in mesh.cell_sets.items()} == {"Körper": 1, "BODY": 1}


#: As Abaqus/CAE writes it: names of sets of the part come again in the assembly, and so do numbers of nodes.
ASSEMBLY = (
    BRICK.replace("*Node, ", "*Part, name=bar\n*Node, ")
    + "*nset, nset=Set-1\n everything\n*elset, elset=Set-1\n 7, 8\n*end part\n*assembly, name=all\n"
    + "*instance, name=bar-1, part=bar\n 10., 0., 0.\n 10., 0., 0., 10., 0., 2., 90.\n*end instance\n"
    + "*node\n 10, 5., 5., 5.\n*nset, nset=pilot\n 10\n*nset, nset=Set-1, instance=bar-1\n 10, 13, 14, 17\n"
    + "*elset, elset=_right, instance=bar-1\n 8,\n*surface, name=right\n _right, S4\n"
    + "*nset, nset=right, elset=_right\n*nset, nset=all\n bar-1.set-1\n*end assembly\n"
)


def test_sets_of_an_assembly_are_apart_from_those_of_its_part(tmp_path: Path) -> None:
    mesh = read_mesh(write_deck(tmp_path / "deck.inp", ASSEMBLY))
    # The part is moved by 10 along x, and turned by a right angle about z there.
    assert (mesh.points.min(axis=0).round(12) == [9, 0, 0]).all()
    assert (mesh.points.max(axis=0).round(12) == [10, 2, 1]).all()
    sizes = {name: len(nodes) for name, nodes in mesh.node_sets.items()}
    assert sizes == {"everything": 12, "bar-1.Set-1": 12, "Set-1": 4, "right": 8, "all": 12}
    np.testing.assert_allclose(mesh.points[mesh.node_sets["Set-1"]][:, 1], 0, atol=1e-15)
    np.testing.assert_allclose(mesh.points[np.unique(mesh.points[:, 1].argmax())][:, 1], 2)
    assert {name: len(cells) for name, cells in mesh.cell_sets.items()} == {"body": 2, "Set-1": 2, "_right": 1}


def test_parts_of_a_model_that_are_left_out_are_told(tmp_path: Path) -> None:
    text = BRICK + (
        "*element, type=B31, elset=rod\n 30, 10, 11\n*beam section, elset=rod\n 1.,\n*tie, name=t\n a, b\n"
        "*element, type=S3, elset=web\n 31, 10, 12, 16\n*tie, name=u\n c, d\n"
    )
    with pytest.warns(InputWarning) as told:
        mesh = read_mesh(write_deck(tmp_path / "deck.inp", text))
    first, second = (str(item.message) for item in told)
    assert first.endswith("without *BEAM SECTION and *TIE")
    assert 'shells of "web" do not lie on faces' in second
    assert {"rod", "web"} <= {*mesh.node_sets}


@pytest.mark.parametrize(
    ("label", "corners"),
    [("S1", "1234"), ("S2", "5678"), ("S3", "1562"), ("S4", "2673"), ("S5", "3784"), ("S6", "4851")],
)
def test_face_labels_are_those_of_the_calculix_manual(label: str, corners: str, tmp_path: Path) -> None:
    deck = write_deck(tmp_path / "deck.inp", f"{BRICK}*surface, name=one\n 7, {label}\n")
    mesh = read_mesh(deck)
    cell = mesh.cells["hexahedron"][0]
    np.testing.assert_array_equal(mesh.nodes("one"), np.sort(cell[[int(corner) - 1 for corner in corners]]))


def test_decks_keep_to_sixteen_entries_and_twenty_characters(tmp_path: Path) -> None:
    write_mesh(bent_bar(HEX20), tmp_path / "bar.inp")
    data = [line for line in (tmp_path / "bar.inp").read_text().splitlines() if not line.startswith("*")]
    entries = [[entry.strip() for entry in line.rstrip(",").split(",")] for line in data]
    assert max(len(line) for line in entries) == 16
    assert max(len(entry) for line in entries for entry in line) <= 20


def test_a_file_in_millimetres_is_scaled(tmp_path: Path) -> None:
    mesh = read_mesh(write_deck(tmp_path / "deck.inp", BRICK), length_unit_in_metre=0.001)
    assert measure_cell_quality(mesh).volume.sum() == pytest.approx(2e-9)
    with pytest.raises(MeshError, match=r"length unit 0 m must be positive"):
        read_mesh(tmp_path / "deck.inp", length_unit_in_metre=0)


def test_named_surfaces_curves_and_points_of_gmsh_become_sets(tmp_path: Path) -> None:
    points = np.vstack([HEX8.nodes, [[5.0, 5, 5]]])
    result = meshio.Mesh(
        points,
        [("quad", [[0, 1, 2, 3]]), ("triangle", [[0, 1, 5]]), ("line", [[6, 7]]), ("hexahedron", [list(range(8))])],
        cell_data={"gmsh:physical": [[1], [2], [3], [4]], "gmsh:geometrical": [[1], [2], [1], [1]]},
        field_data={"foot": np.array([1, 2]), "corner": np.array([2, 2]), "edge": np.array([3, 1])},
    )
    meshio.write(tmp_path / "old.msh", result, file_format="gmsh22", binary=False)
    with pytest.warns(InputWarning, match='"corner" do not lie on faces'):
        mesh = read_mesh(tmp_path / "old.msh")
    assert mesh.n_node == 8
    np.testing.assert_array_equal(mesh.face_sets["foot"], [[0, 4]])
    np.testing.assert_array_equal(mesh.nodes("corner"), [0, 1, 5])
    np.testing.assert_array_equal(mesh.nodes("edge"), [6, 7])
    np.testing.assert_array_equal(mesh.cell_sets["volume_4"], [0])


def test_sets_of_one_kind_and_parts_without_any_set_survive(mesh_suffix: str, tmp_path: Path) -> None:
    mesh = bent_bar(HEX8)
    for kind, sets in (("cell_sets", {"part": np.arange(5)}), ("face_sets", {"foot": mesh.face_sets["foot"]})):
        none: dict[str, NDArray[np.int64]] = {}
        bare = Mesh(points=mesh.points, cells=mesh.cells)
        write_mesh(replace(bare, **{"cell_sets": none, "face_sets": none, kind: sets}), tmp_path / f"bar{mesh_suffix}")
        read = read_mesh(tmp_path / f"bar{mesh_suffix}")
        assert read.n_cell == mesh.n_cell
        assert {name: len(members) for name, members in getattr(read, kind).items()} == {
            name: len(members) for name, members in sets.items()
        }


def test_a_cell_that_version_2_repeats_for_each_group_is_one_cell(tmp_path: Path) -> None:
    cells = [("hexahedron", [list(range(8))]), ("hexahedron", [list(range(8))])]
    tags = {"gmsh:physical": [[1], [2]], "gmsh:geometrical": [[1], [1]]}
    names = {"part": np.array([1, 3]), "whole": np.array([2, 3])}
    result = meshio.Mesh(HEX8.nodes, cells, cell_data=tags, field_data=names)
    meshio.write(tmp_path / "old.msh", result, file_format="gmsh22")
    mesh = read_mesh(tmp_path / "old.msh")
    assert mesh.n_cell == 1
    assert {name: members.tolist() for name, members in mesh.cell_sets.items()} == {"part": [0], "whole": [0]}


#: A unit cube whose faces z = 0 and z = 1 are two surfaces; a group holds the second one reversed, by a number below 0.
CUBE = "".join(f"{k + 1} {x:g} {y:g} {z:g}\n" for k, (x, y, z) in enumerate((HEX8.nodes + 1) / 2))
CUBE_2 = (
    f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n8\n{CUBE}$EndNodes\n$Elements\n3\n"
    "1 3 2 7 1 1 2 3 4\n2 3 2 -7 2 5 6 7 8\n3 5 2 9 1 1 2 3 4 5 6 7 8\n$EndElements\n"
)
CUBE_4 = (
    '$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 7 "ends"\n$EndPhysicalNames\n'
    "$Entities\n0 0 2 1\n1 0 0 0 1 1 0 1 7 0\n2 0 0 1 1 1 1 1 -7 0\n1 0 0 0 1 1 1 0 0\n$EndEntities\n"
    "$Nodes\n1 8 1 8\n3 1 0 8\n1\n2\n3\n4\n5\n6\n7\n8\n"
    + "".join(line.partition(" ")[2] + "\n" for line in CUBE.splitlines())
    + "$EndNodes\n$Elements\n3 3 1 3\n2 1 3 1\n1 1 2 3 4\n2 2 3 1\n2 5 6 7 8\n3 1 5 1\n3 1 2 3 4 5 6 7 8\n"
    "$EndElements\n"
)


@pytest.mark.parametrize(("text", "name"), [(CUBE_2, "surface_7"), (CUBE_4, "ends")], ids=["2.2", "4.1"])
def test_a_surface_that_a_group_of_gmsh_holds_reversed_belongs_to_it(text: str, name: str, tmp_path: Path) -> None:
    mesh = read_mesh(write_deck(tmp_path / "cube.msh", text))
    assert mesh.face_sets[name].tolist() == [[0, 4], [0, 5]]


def test_fields_at_nodes_reach_vtk_and_gmsh_files(tmp_path: Path) -> None:
    mesh = bent_bar(HEX20)
    fields = {"temperature": mesh.points @ [1, 2, 3], "displacement": mesh.points**2}
    for name, file_format in (("bar.vtu", "vtu"), ("bar.msh", "gmsh")):
        write_mesh(mesh, tmp_path / name, fields)
        result = meshio.read(tmp_path / name, file_format=file_format).point_data
        for field, values in fields.items():
            np.testing.assert_allclose(result[field], values, rtol=1e-15)


# Bad input: one sentence with file, value and remedy.


def test_an_absent_file_is_named(mesh_suffix: str, tmp_path: Path) -> None:
    with pytest.raises(MeshError, match=rf"no_such\{mesh_suffix} does not exist"):
        read_mesh(tmp_path / f"no_such{mesh_suffix}")


def test_an_unknown_suffix_is_answered_with_the_known_ones(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match=r'suffix "\.stl".*\.bdf, \.inp, \.msh, \.nas, \.vtu'):
        read_mesh(tmp_path / "blade.stl")
    with pytest.raises(MeshError, match=r'suffix ""'):
        write_mesh(bent_bar(HEX8), tmp_path / "blade")


@pytest.mark.parametrize("part", [0.0, 0.1, 0.5, 0.9])
def test_a_file_cut_short_is_refused_in_one_line(
    mesh_suffix: str, part: float, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    mesh = replace(bent_bar(HEX20), node_sets={}, face_sets={}, cell_sets={})
    path = tmp_path / f"bar{mesh_suffix}"
    write_mesh(mesh, path)
    content = path.read_bytes()
    path.write_bytes(content[: int(part * len(content))])
    with pytest.raises(MeshError, match=rf"bar\{mesh_suffix}") as refusal:
        read_mesh(path)
    assert "\n" not in str(refusal.value)
    assert capfd.readouterr() == ("", "")


def test_noise_is_refused(mesh_suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"noise{mesh_suffix}"
    path.write_bytes(np.random.default_rng(5).bytes(5000))
    with pytest.raises(MeshError, match=rf"noise\{mesh_suffix}"):
        read_mesh(path)


@pytest.mark.parametrize(("cell_type", "n_node"), [("wedge", 6), ("pyramid", 5), ("hexahedron27", 27)])
def test_other_solid_cells_are_refused_with_type_and_count(cell_type: str, n_node: int, tmp_path: Path) -> None:
    points = np.vstack([HEX8.nodes, np.random.default_rng(6).standard_normal((27, 3))])
    cells = [("hexahedron", [list(range(8))]), (cell_type, [list(range(n_node))] * 3)]
    meshio.write(tmp_path / "mixed.vtu", meshio.Mesh(points, cells))
    why = ", which are far too stiff in bending" if cell_type in {"wedge", "pyramid"} else ""
    with pytest.raises(
        MeshError, match=rf"mixed\.vtu has .*3 {cell_type}{why}\): remesh with hexahedron or hexahedron20"
    ):
        read_mesh(tmp_path / "mixed.vtu")


@pytest.mark.parametrize("suffix", [".vtu", ".msh"])
def test_tetrahedra_of_four_nodes_are_refused_with_the_remedy(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"linear{suffix}"
    result = meshio.Mesh(HEX8.nodes, [("tetra", [[0, 1, 3, 4], [1, 2, 3, 6]]), ("wedge", [[0, 1, 3, 4, 5, 7]])])
    meshio.write(path, result, file_format="gmsh22" if suffix == ".msh" else "vtu")
    with pytest.raises(MeshError, match=r"linear.* 2 tetra cells of 4 nodes.*stiff in bending: convert them to 10"):
        read_mesh(path)


def test_tetrahedra_of_four_nodes_in_a_deck_are_refused_with_the_remedy(tmp_path: Path) -> None:
    deck = BRICK.replace("type=C3D8I", "type=C3D4").replace(" 8, 11, 21, 22, 12, 15, 25, 26, 16", " 8, 11, 21, 22, 15")
    with pytest.raises(MeshError, match=r"deck\.inp has 1 tetra cells of 4 nodes"):
        read_mesh(write_deck(tmp_path / "deck.inp", deck))


def test_a_tetrahedron_of_the_gmsh_manual_is_read_in_its_order(tmp_path: Path) -> None:
    # Edges of the manual's drawing "Tetrahedron10": the last two stand the other way round in VTK.
    edges = [(0, 1), (1, 2), (0, 2), (0, 3), (2, 3), (1, 3)]
    corners = np.array([[0, 0, 0], [2.0, 0, 0], [0, 3.0, 0], [0, 0, 5.0]])
    points = np.vstack([corners, [(corners[a] + corners[b]) / 2 for a, b in edges]])
    lines = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$Nodes", "1 10 1 10", "3 1 0 10"]
    lines += [str(k) for k in range(1, 11)] + [f"{x} {y} {z}" for x, y, z in points]
    lines += ["$EndNodes", "$Elements", "1 1 1 1", "3 1 11 1", " ".join(["1", *(str(k) for k in range(1, 11))])]
    path = tmp_path / "one.msh"
    path.write_text("\n".join([*lines, "$EndElements", ""]))
    read = read_mesh(path)
    np.testing.assert_allclose(read.points[read.cells["tetra10"][0]], TET10.nodes * [2, 3, 5], atol=1e-15)
    write_mesh(read, tmp_path / "two.msh")
    assert lines[-1] in (tmp_path / "two.msh").read_text().splitlines()


@pytest.mark.parametrize(("label", "corners"), [("S1", "123"), ("S2", "142"), ("S3", "243"), ("S4", "341")])
def test_face_labels_of_tetrahedra_are_those_of_the_calculix_manual(label: str, corners: str, tmp_path: Path) -> None:
    write_mesh(Mesh(points=TET10.nodes, cells={"tetra10": np.arange(10)[None]}), tmp_path / "one.inp")
    text = (tmp_path / "one.inp").read_text()
    mesh = read_mesh(write_deck(tmp_path / "named.inp", f"{text}*surface, name=one\n 1, {label}\n"))
    result = mesh.nodes("one")
    np.testing.assert_array_equal(result[result < 4], np.sort([int(corner) - 1 for corner in corners]))
    assert len(result) == 6


def test_a_face_that_tetrahedra_have_not_is_refused(tmp_path: Path) -> None:
    write_mesh(Mesh(points=TET10.nodes, cells={"tetra10": np.arange(10)[None]}), tmp_path / "one.inp")
    text = (tmp_path / "one.inp").read_text()
    with pytest.raises(MeshError, match=r'surface "one" names the face "S5" of a tetra10'):
        read_mesh(write_deck(tmp_path / "named.inp", f"{text}*surface, name=one\n 1, S5\n"))


def test_triangles_name_the_faces_of_tetrahedra_under_them(tmp_path: Path) -> None:
    face = list(TET10.faces[2])
    result = meshio.Mesh(
        TET10.nodes,
        [("triangle6", [face]), ("tetra10", [list(range(10))])],
        cell_data={"gmsh:physical": [np.array([7]), np.array([8])], "gmsh:geometrical": [np.array([1]), np.array([1])]},
        field_data={"slope": np.array([7, 2]), "body": np.array([8, 3])},
    )
    meshio.write(tmp_path / "named.msh", result, file_format="gmsh22")
    mesh = read_mesh(tmp_path / "named.msh")
    np.testing.assert_array_equal(mesh.face_sets["slope"], [[0, 2]])


def test_a_surface_mesh_is_refused(tmp_path: Path) -> None:
    meshio.write(tmp_path / "skin.vtu", meshio.Mesh(HEX8.nodes, [("quad", [[0, 1, 2, 3], [4, 5, 6, 7]])]))
    with pytest.raises(MeshError, match=r"skin\.vtu has no solid cells \(2 quad\)"):
        read_mesh(tmp_path / "skin.vtu")


def test_a_cell_that_is_there_twice_counts_once_or_is_refused(tmp_path: Path) -> None:
    """Its stiffness and mass would count twice; node by node the same it is one cell, as version 2 of Gmsh has it."""
    same = BRICK + "*element, type=C3D8\n 9, 11, 21, 22, 12, 15, 25, 26, 16\n"
    mesh = read_mesh(write_deck(tmp_path / "same.inp", same))
    assert measure_cell_quality(mesh).volume.sum() == pytest.approx(2)
    turned = BRICK + "*element, type=C3D8\n 9, 21, 22, 12, 11, 25, 26, 16, 15\n"
    with pytest.raises(MeshError, match="has 1 cells on the same nodes as other ones"):
        read_mesh(write_deck(tmp_path / "turned.inp", turned))


def test_linear_and_quadratic_cells_that_touch_are_refused(tmp_path: Path) -> None:
    points = np.vstack([HEX20.nodes, HEX8.nodes[[1, 2, 5, 6]] + [2, 0, 0]])
    cells = {"hexahedron20": np.arange(20)[None], "hexahedron": np.array([[1, 20, 21, 2, 5, 22, 23, 6]])}
    write_mesh(Mesh(points=points, cells=cells), tmp_path / "mixed.inp")
    with pytest.raises(MeshError, match=r"joins hexahedron20 and hexahedron cells at 4 nodes"):
        read_mesh(tmp_path / "mixed.inp")


def test_an_inverted_cell_is_refused_by_the_number_in_the_deck(tmp_path: Path) -> None:
    deck = BRICK.replace(" 8, 11, 21, 22, 12, 15, 25, 26, 16", " 8, 15, 25, 26, 16, 11, 21, 22, 12")
    with pytest.raises(InvertedCell, match=r'deck\.inp, hexahedron cells of cell set "body": 1 of 2 .*\(cell 8;'):
        read_mesh(write_deck(tmp_path / "deck.inp", deck))


DAMAGE: dict[str, tuple[Callable[[str], str], str]] = {
    "unknown element": (lambda text: text.replace("C3D8I", "C3D7"), 'elements of type "C3D7" are not supported'),
    "undefined node": (lambda text: text.replace("26, 16\n", "26, 77\n"), "node 77 is used but not defined"),
    "double node": (lambda text: text.replace(" 99,", " 10,"), "node 10 is defined twice.*flat"),
    "letters": (lambda text: text.replace(" 2., 1., 1.", " 2., one, 1."), r"a line of \*NODE .*one"),
    "two coordinates": (
        lambda text: text.replace(", 0.\n", "\n").replace(", 1.\n", "\n"),
        "2 coordinates instead of 3",
    ),
    "nodes by rule": (lambda text: f"{text}*ngen\n 1, 2, 1\n", r"\*NGEN generates or moves nodes"),
    "instances": (lambda text: f"{text}*instance, name=a\n*instance, name=b\n", "several part instances"),
    "no node": (lambda text: text[text.index("*element") :].join(["*node\n", ""]), r"no \*NODE lines"),
    "odd place": (lambda text: f"{text}*instance, name=a\n 1., 2.\n", "a translation has 3 numbers"),
    "unknown set": (lambda text: f"{text}*elset, elset=new\n other\n", 'refers to the set "other"'),
    "unknown face": (lambda text: f"{text}*surface, name=new\n 7, S9\n", 'names the face "S9"'),
    "absent include": (
        lambda text: f"{text}*include, input=more.inp\n",
        'includes "more.inp", which is not in the same folder',
    ),
    "its own include": (lambda text: f"{text}*include, input=deck.inp\n", "includes itself"),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_deck_is_refused_with_its_reason(damage: str, tmp_path: Path) -> None:
    change, reason = DAMAGE[damage]
    with pytest.raises(MeshError, match=rf"deck\.inp .*{reason}"):
        read_mesh(write_deck(tmp_path / "deck.inp", change(BRICK)))


@pytest.mark.parametrize(
    ("head", "reason"),
    [
        ("$MeshFormat\n4 0 8\n$EndMeshFormat\n", "has MSH version 4: save it with Gmsh as version 4.1"),
        ('(0 "Fluent")\n(2 3)\n', r'does not begin with "\$MeshFormat"'),
    ],
)
def test_other_kinds_of_msh_are_refused(head: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / "other.msh").write_text(head)
    with pytest.raises(MeshError, match=rf"other\.msh {reason}"):
        read_mesh(tmp_path / "other.msh")


def test_a_grid_of_several_pieces_is_refused(tmp_path: Path) -> None:
    write_mesh(bent_bar(HEX8), tmp_path / "bar.vtu")
    content = (tmp_path / "bar.vtu").read_bytes()
    piece = content[content.index(b"<Piece") : content.index(b"</Piece>") + 8]
    (tmp_path / "two.vtu").write_bytes(content.replace(piece, piece + piece))
    with pytest.raises(MeshError, match=r"two\.vtu consists of 2 pieces"):
        read_mesh(tmp_path / "two.vtu")


def test_what_a_format_cannot_carry_is_refused(tmp_path: Path) -> None:
    mesh = bent_bar(HEX8)
    with pytest.raises(MeshError, match=r'carries no fields, so "u" would be lost: write bar\.vtu'):
        write_mesh(mesh, tmp_path / "bar.inp", {"u": mesh.points})
    with pytest.raises(MeshError, match=r'field "u" has 3 rows'):
        write_mesh(mesh, tmp_path / "bar.vtu", {"u": mesh.points[:3]})
    spaced = replace(mesh, node_sets={"root face": np.array([0])})
    with pytest.raises(MeshError, match=r'node set "root face" cannot be written to an \.inp'):
        write_mesh(spaced, tmp_path / "bar.inp")
    assert not (tmp_path / "bar.inp").exists()
    with pytest.raises(MeshError, match=r'"Foot" and "FOOT" are the same set'):
        write_mesh(replace(mesh, node_sets={"Foot": np.array([0]), "FOOT": np.array([1])}), tmp_path / "bar.inp")
    with pytest.raises(MeshError, match=r'two sets of different kind are called "foot"'):
        write_mesh(replace(mesh, node_sets={"foot": np.array([0])}), tmp_path / "bar.msh")
    with pytest.raises(MeshError, match=r"cannot be written \(No such file"):
        write_mesh(mesh, tmp_path / "no" / "bar.vtu")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("*SURFACE, NAME=TOP", "*SURFACE", r"a set of \*SURFACE has no name, so give it one: \*SURFACE, NAME=NAME"),
        ("*NSET, NSET=TIP", "*NSET", r"a set of \*NSET has no name, so give it one: \*NSET, NSET=NAME"),
        ("ELSET=BODY", "ELSET=", r"a set of \*ELEMENT has no name, so give it one: \*ELEMENT, ELSET=NAME"),
        ("NAME=FOOT", "NAME=TOP", 'the surface "TOP" is defined twice, so rename one'),
    ],
)
def test_sets_without_a_name_and_surfaces_of_one_name_are_refused(
    old: str, new: str, said: str, tmp_path: Path
) -> None:
    corners = "".join(f"{k}, {x}, {y}, {z}\n" for k, (x, y, z) in enumerate(HEX8.nodes, start=1))
    sets = "*NSET, NSET=TIP\n8\n*SURFACE, NAME=TOP\n1, S2\n*SURFACE, NAME=FOOT\n1, S1\n"
    deck = f"*NODE\n{corners}*ELEMENT, TYPE=C3D8, ELSET=BODY\n1, 1, 2, 3, 4, 5, 6, 7, 8\n{sets}"
    path = tmp_path / "cube.inp"
    path.write_text(deck)
    assert set(read_mesh(path).face_sets) == {"TOP", "FOOT"}
    assert old in deck
    path.write_text(deck.replace(old, new))
    with pytest.raises(MeshError, match=said):
        read_mesh(path)


def test_two_groups_of_one_name_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "two.msh"
    names = '$PhysicalNames\n2\n2 1 "top"\n3 2 "top"\n$EndPhysicalNames\n'
    path.write_text(f"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n{names}")
    with pytest.raises(MeshError, match=r'several physical groups called "top" \(a surface and a volume\): rename one'):
        read_mesh(path)


DECK = "*NODE\n1, 0, 0, 0\n*ELEMENT, TYPE=C3D8\n1, 1, 2, 3, 4, 5, 6, 7, 8\n"


@pytest.mark.parametrize(
    "line", ["1, 2000000000", "1, 99999999999999999999", "-5, 5", "5, 1", "1, 5, 0", "1, 5, -1", "1, x", "1"]
)
def test_a_generated_set_that_no_mesh_has_is_refused_before_memory_is_taken(tmp_path: Path, line: str) -> None:
    (tmp_path / "m.inp").write_text(f"{DECK}*NSET, NSET=A, GENERATE\n{line}\n")
    with pytest.raises(MeshError, match=r"GENERATE gives|\*NSET is truncated"):
        read_mesh(tmp_path / "m.inp")


@pytest.mark.parametrize("number", ["2000000000", "9" * 5000])
def test_a_number_of_a_gmsh_file_that_its_bytes_cannot_fill_is_refused(tmp_path: Path, number: str) -> None:
    mesh = mesh_blocks([Block.box([(0, 2), (0, 1), (0, 1)], (2, 1, 1), {})], HEX8)
    write_mesh(mesh, tmp_path / "m.msh")
    text = (tmp_path / "m.msh").read_text()
    line = next(line for line in text.splitlines() if line.startswith("1 12 1 12"))
    for old, new in ((line, f"{number} 12 1 12"), (line, f"1 12 1 {number}"), ("\n11\n", f"\n{number}\n")):
        assert old in text
        (tmp_path / "m.msh").write_text(text.replace(old, new))
        with pytest.raises(MeshError, match="is not possible"):
            read_mesh(tmp_path / "m.msh")
