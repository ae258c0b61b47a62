"""Nastran bulk data: a tetrahedron and a brick of the quick reference guide, with what names their parts."""

from pathlib import Path

import numpy as np
import pytest

from fe.element import HEX20, TET10
from fe.errors import MeshError
from fe.file.mesh_file import read_mesh, write_mesh
from geometry.errors import InputWarning

#: A tetrahedron of ten nodes with legs of 2 and its midside nodes G5 (1-2), G6 (2-3), G7 (1-3), G8 (1-4), G9, G10.
TETRA = """\
SOL 103
CEND
BEGIN BULK
$ Femap with NX Nastran Property 7 : body
$HMNAME PROP                   8"foot" 4
GRID,11,,0.,0.,0.
GRID,12,,2.,0.,0.
GRID,13,,0.,2.,0.
GRID,14,,0.,0.,2.
GRID,15,,1.,0.,0.
GRID,16,,1.,1.,0.
GRID,17,,0.,1.,0.
GRID,18,,0.,0.,1.
GRID,19,,1.,0.,1.
GRID,20,,0.,1.,1.
CTETRA         5       7      11      12      13      14      15      16+
+             17      18      19      20
CTRIA3         6       8      11      13      12
CTRIA3         9       3      11      12      14
SET1,4,12,THRU,14,11
SPC1,2,123,11,12,13
ENDDATA
"""


def written(folder: Path, text: str, suffix: str = ".bdf") -> Path:
    path = folder / f"part{suffix}"
    path.write_text(text)
    return path


@pytest.mark.parametrize("suffix", [".bdf", ".nas"])
def test_cells_properties_and_sets_are_read(tmp_path: Path, suffix: str) -> None:
    mesh = read_mesh(written(tmp_path, TETRA, suffix), 1e-3)
    np.testing.assert_allclose(mesh.points[mesh.cells["tetra10"][0]] * 1e3, 2 * TET10.nodes, atol=1e-12)
    assert mesh.cell_sets["body"].tolist() == [0]
    corners = mesh.points[:4] * 1e3
    np.testing.assert_array_equal(corners[mesh.node_sets["set_4"]], [[2, 0, 0], [0, 2, 0], [0, 0, 2], [0, 0, 0]])
    np.testing.assert_array_equal(mesh.node_sets["spc_2"], [0, 1, 2])
    # Shells name the faces under them: z = 0, and y = 0 without a name of its own.
    np.testing.assert_array_equal(mesh.points[mesh.nodes("foot"), 2], 0)
    np.testing.assert_array_equal(mesh.points[mesh.nodes("property_3"), 1], 0)


def test_a_brick_of_twenty_nodes_is_read_in_its_order(tmp_path: Path) -> None:
    # G9 to G12 on the first face, G13 to G16 between the faces, G17 to G20 on the second (quick reference guide).
    order = [*range(8), 8, 9, 10, 11, 16, 17, 18, 19, 12, 13, 14, 15]
    points = HEX20.nodes[order] + 1
    grid = "".join(f"GRID,{k},,{x:.1f},{y:.1f},{z:.1f}\n" for k, (x, y, z) in enumerate(points, start=1))
    card = "CHEXA,1,1,1,2,3,4,5,6,+\n+,7,8,9,10,11,12,13,14,+\n+,15,16,17,18,19,20\n"
    mesh = read_mesh(written(tmp_path, f"BEGIN BULK\n{grid}{card}ENDDATA\n"))
    np.testing.assert_array_equal(mesh.points[mesh.cells["hexahedron20"][0]], HEX20.nodes + 1)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("CTETRA         5", "CTETRA    five  ", "has a CTETRA five that cannot be read"),
        ("      14      15", "      14      55", "element 5 on grid point 55, which does not exist"),
        ("+             17      18", "+             17        ", "1 of 10 nodes are missing"),
        ("CTRIA3         9", "CTRIA3         6", "two elements 6"),
        ("GRID,12,,2.", "GRID,11,,2.", "two grid points 11"),
        ("SET1,4", "INCLUDE 'more.bdf'\nSET1,4", "includes \"'more.bdf'\", which is not in the same folder"),
        ("SET1,4", "INCLUDE part.bdf\nSET1,4", "includes itself"),
        ("BEGIN BULK", "$", 'has no line "BEGIN BULK"'),
        ("GRID,13,,", "GRID,13,9,", "local coordinate system: write them in the basic one"),
        ("+             17      18      19      20\n", "", "tetra cells of 4 nodes|cannot be read"),
        ("SET1,4,12,THRU,14,11", "SET1,4,twelve", "has a SET1 card that cannot be read"),
        ("SET1,4,12,THRU,14,11", "SET1,4,THRU,14", "has a SET1 card that cannot be read"),
        ("SET1,4,12,THRU,14,11", "SET1,4,12,THRU", "has a SET1 card that cannot be read"),
        ("ENDDATA", "", 'has no line "ENDDATA"'),
        ('8"foot"', '8"body"', 'two properties called "body": rename one'),
    ],
)
def test_what_cannot_be_read_right_is_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in TETRA
    with pytest.raises(MeshError, match=said):
        read_mesh(written(tmp_path, TETRA.replace(old, new)))


#: The tetrahedron in lines of four fields.
WIDE = "".join(
    f"{name:8s}" + "".join(f"{number:16d}" for number in numbers) + "\n"
    for name, numbers in (
        ("CTETRA*", (5, 7, 11, 12)), ("*", (13, 14, 15, 16)), ("*", (17, 18, 19, 20)),
    )
)  # fmt: skip
LAYOUTS = {
    "fields of 16": TETRA.replace(TETRA[TETRA.index("CTETRA") : TETRA.index("CTRIA3")], WIDE),
    "blank continuation": TETRA.replace("16+\n+ ", "16\n  "),
    "lower case": TETRA.replace("$ Femap with NX Nastran Property", "$ femap")
    .lower()
    .replace("$ femap", "$ Femap Property"),
    "bulk data alone": TETRA[TETRA.index("$ Femap") : TETRA.index("ENDDATA")],
    "grid points in fields of 16": TETRA.replace(
        "GRID,12,,2.,0.,0.",
        "GRID*                 12                             2.0             0.0\n*                    0.0",
    ),
    "SPC cards": TETRA.replace("SPC1,2,123,11,12,13", "SPC,2,11,123,0.,12,123,0.\nSPC,2,13,123,0."),
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_every_layout_of_cards_is_the_same_mesh(tmp_path: Path, layout: str) -> None:
    text = LAYOUTS[layout]
    assert text != TETRA
    expected = read_mesh(written(tmp_path, TETRA))
    mesh = read_mesh(written(tmp_path, text))
    np.testing.assert_array_equal(mesh.points, expected.points)
    np.testing.assert_array_equal(mesh.cells["tetra10"], expected.cells["tetra10"])
    assert {name: nodes.tolist() for name, nodes in mesh.node_sets.items()} == {
        "set_4": [1, 2, 3, 0],
        "spc_2": [0, 1, 2],
    }
    assert "body" in mesh.cell_sets


def test_included_files_stand_where_they_are_named(tmp_path: Path) -> None:
    first, last = TETRA.index("GRID,15"), TETRA.index("SET1")
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "cells.bdf").write_text(TETRA[first:last])
    mesh = read_mesh(written(tmp_path, TETRA[:first] + "include 'parts/\n cells.bdf'\n" + TETRA[last:]))
    np.testing.assert_array_equal(mesh.cells["tetra10"], read_mesh(written(tmp_path, TETRA)).cells["tetra10"])


def test_what_would_join_or_load_the_part_is_told_and_left_out(tmp_path: Path) -> None:
    more = "CONM2,30,14,,0.1\nRBE2,31,14,123,12\nCBAR,32,9,14,12\nCTRIA3,33,4,12,13,20\nPLOTEL,34,11,14\n"
    with pytest.warns(InputWarning) as told:
        mesh = read_mesh(written(tmp_path, TETRA.replace("ENDDATA", more + "ENDDATA")))
    first, second = (str(item.message) for item in told)
    assert first.endswith("without CONM2 and RBE2 and CBAR")
    assert 'shells of "property_4" do not lie on faces' in second
    assert mesh.n_cell == 1


def test_bulk_data_is_not_written(tmp_path: Path) -> None:
    mesh = read_mesh(written(tmp_path, TETRA))
    with pytest.raises(MeshError, match=r'the suffix ".bdf", which is unknown: use one of .inp, .msh, .vtu'):
        write_mesh(mesh, tmp_path / "out.bdf")


@pytest.mark.parametrize("text", ["BEGIN BULK\n", "BEGIN BULK", TETRA.partition("ENDDATA")[0], "ENDDATA\nBEGIN BULK\n"])
def test_a_file_without_an_end_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(MeshError, match="ENDDATA"):
        read_mesh(written(tmp_path, text))


def test_a_range_of_two_thousand_million_nodes_takes_those_that_there_are(tmp_path: Path) -> None:
    wide = TETRA.replace("SET1,4,12,THRU,14,11", "SET1,4,12,THRU,2000000000")
    (tmp_path / "wide.bdf").write_text(wide)
    assert wide != TETRA
    mesh = read_mesh(tmp_path / "wide.bdf")
    assert len(mesh.node_sets["set_4"]) == 9  # all but grid point 11
