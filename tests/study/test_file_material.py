"""Material and supports that a mesh file carries, in a case of a part and in `stickslip modes`."""

import json
import re
import warnings
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest

from casefile.errors import CaseError
from fe.element import HEX8, HEX20
from fe.file.mesh_file import read_mesh, write_mesh
from fe.mesh import Mesh
from fe.mesher.block import Block, mesh_blocks
from study.case.setup import read_case
from study.cli import main

CARRIED = "*MATERIAL, NAME=ALLOY\n*ELASTIC\n7e10, 0.33\n*DENSITY\n2700.\n"
CASE = """\
schema = 2
[structure]
kind = "part"
file = "bar.inp"
length_unit = "m"
[structure.reduction]
modes = 4
[[structure.support]]
on = ["clamp"]
[[structure.boundary]]
name = "end"
on = "end"
"""
OWN = '[structure.material]\nyoung = "YOUNG"\npoisson = 0.33\ndensity = "2700 kg/m^3"\n'


@pytest.fixture
def bar() -> Mesh:
    return mesh_blocks([Block.box(((0, 0.1), (0, 0.01), (0, 0.01)), (4, 1, 1), {"u0": "clamp", "u1": "end"})], HEX20)


@pytest.fixture
def home(at_home: Path, bar: Mesh) -> Path:
    edge = bar.nodes("clamp")[bar.points[bar.nodes("clamp"), 1] == 0]
    write_mesh(replace(bar, node_sets={"line": edge}), at_home / "bar.inp")
    with (at_home / "bar.inp").open("a") as deck:
        deck.write(CARRIED)
    return at_home


def own(young: str) -> str:
    return CASE.replace("[structure.reduction]", OWN.replace("YOUNG", young) + "[structure.reduction]")


def test_a_case_without_a_material_uses_that_of_its_deck(home: Path) -> None:
    """Mass and stiffness are those of a case that says the same values itself."""
    models = []
    for text in (CASE, own("70 GPa")):
        (home / "my.toml").write_text(text)
        models.append(read_case(home / "my.toml").model.system)
    np.testing.assert_array_equal(models[0].stiffness, models[1].stiffness)
    np.testing.assert_array_equal(models[0].mass, models[1].mass)


def test_a_case_that_disagrees_is_used_with_a_sentence(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (home / "my.toml").write_text(own("72 GPa"))
    read_case(home / "my.toml")
    told = capfd.readouterr().err
    assert "bar.inp contains the material ALLOY, 70 GPa, 0.33, 2700 kg/m^3 (read in N, m and s), whose young" in told
    (home / "my.toml").write_text(own("70 GPa"))
    read_case(home / "my.toml")
    assert "ALLOY" not in capfd.readouterr().err


@pytest.mark.parametrize(
    ("carried", "says"),
    [
        ("", "bar.inp contains no material: add"),
        (CARRIED.replace("2700.", "2.7e-9"), "beyond any solid.*if the file has other units, add"),
        (CARRIED.replace("*DENSITY\n2700.\n", ""), 'material "ALLOY" has no density: add'),
    ],
)
def test_no_usable_material_is_one_sentence(home: Path, carried: str, says: str) -> None:
    deck = home / "bar.inp"
    deck.write_text(deck.read_text().replace(CARRIED, carried))
    (home / "my.toml").write_text(CASE)
    with pytest.raises(CaseError, match=says):
        read_case(home / "my.toml")


@pytest.mark.parametrize(
    ("name", "says"), [("bat.inp", "does not exist"), ("bar.med", 'suffix ".med"'), (".", "suffix")]
)
def test_a_file_that_cannot_be_read_is_not_said_to_have_no_material(home: Path, name: str, says: str) -> None:
    (home / "my.toml").write_text(CASE.replace("bar.inp", name))
    with pytest.raises(CaseError, match=says):
        read_case(home / "my.toml")


def test_a_point_array_of_zeros_and_ones_is_a_support(home: Path, bar: Mesh) -> None:
    """A grid of another program: `fixed` says which points stand still."""
    fixed = np.zeros(bar.n_node, dtype=np.uint8)
    fixed[bar.nodes("clamp")] = 1
    end = np.zeros(bar.n_node)
    end[bar.nodes("end")] = 1.0
    grid = meshio.Mesh(
        points=bar.points.copy(), cells=[("hexahedron20", bar.cells["hexahedron20"].copy())],
        point_data={
            "fixed": fixed, "end": end, "temperature": np.linspace(0, 2, bar.n_node), "flow": np.ones((bar.n_node, 3)),
        },
    )  # fmt: skip
    meshio.vtu.write(str(home / "bar.vtu"), grid)
    read = read_mesh(home / "bar.vtu")
    assert set(read.node_sets) == {"fixed", "end"}
    np.testing.assert_array_equal(read.nodes("fixed"), bar.nodes("clamp"))
    (home / "deck.toml").write_text(own("70 GPa"))
    (home / "grid.toml").write_text(own("70 GPa").replace("bar.inp", "bar.vtu").replace('["clamp"]', '["fixed"]'))
    deck, grids = (read_case(home / name).model.system for name in ("deck.toml", "grid.toml"))
    # The same mesh in another file: the order of its sums.
    np.testing.assert_allclose(grids.stiffness, deck.stiffness, rtol=0, atol=1e-9 * np.abs(deck.stiffness).max())


def test_modes_without_pictures_write_the_grid_alone_with_the_material_of_the_deck(
    home: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("a graphics library was asked for")

    monkeypatch.setattr("study.modes.run.require_egl", refuse)
    words = ["modes", "bar.inp", "--length-unit", "m", "--fix", "clamp", "--n-modes", "1", "--no-pictures", "--json"]
    result = []
    for more in ([], ["--young", "70 GPa", "--density", "2700 kg/m^3"], ["--young", "280 GPa"]):
        assert main([*words, *more, "--out", "out"]) == 0
        told = capfd.readouterr()
        result.append(json.loads(told.out)["frequency_hz"][0])
        assert [Path(file).name for file in json.loads(told.out)["files"]] == ["bar_modes.vtu"]
        assert ("contains a material of 70 GPa" in told.err) == ("280 GPa" in more)
    assert {file.name for file in (home / "out").iterdir()} == {"bar_modes.vtu"}
    assert result[1] == pytest.approx(result[0], rel=1e-12)
    # Frequencies grow with the root of the modulus.
    assert result[2] == pytest.approx(2 * result[0], rel=1e-9)
    assert main([*words, "--film", "1"]) != 0
    assert "--film 1 needs pictures" in capfd.readouterr().err


SECOND = "*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1e11, 0.3\n*DENSITY\n7800.\n"


@pytest.mark.parametrize(
    ("carried", "says"),
    [
        (CARRIED + SECOND, 'has the materials "ALLOY" and "STEEL", but a part has only one: give --young'),
        (CARRIED.replace("2700.", "2.7e-9"), "beyond any solid.*if the file has other units, give --young"),
        (CARRIED.replace("*ELASTIC\n", "*ELASTIC, TYPE=ORTHO\n"), "is not isotropic: give --young"),
    ],
)
def test_modes_refuse_a_material_that_cannot_be_that_of_the_mesh(
    home: Path, capfd: pytest.CaptureFixture[str], carried: str, says: str
) -> None:
    """They were those of steel, without a word."""
    deck = home / "bar.inp"
    deck.write_text(deck.read_text().replace(CARRIED, carried))
    words = ["modes", "bar.inp", "--length-unit", "m", "--fix", "clamp", "--n-modes", "1", "--no-pictures"]
    assert main(words) != 0
    assert re.search(says, capfd.readouterr().err)
    assert main([*words, "--young", "70 GPa", "--poisson", "0.33", "--density", "2700 kg/m^3"]) == 0


def test_modes_tell_the_material_that_they_use(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["modes", "bar.inp", "--length-unit", "m", "--fix", "clamp", "--n-modes", "1", "--no-pictures"]) == 0
    assert "the material ALLOY of bar.inp is used: 70 GPa, 0.33, 2700 kg/m^3" in capfd.readouterr().err
    words = ["modes", "bar.inp", "--length-unit", "m", "--fix", "clamp", "--n-modes", "1", "--no-pictures"]
    assert main([*words, "--young", "80 GPa"]) == 0
    told = capfd.readouterr().err
    assert "is used" not in told
    assert "whose young the options replace" in told


def test_modes_of_bodies_that_are_not_joined_name_the_remedy(
    home: Path, bar: Mesh, capfd: pytest.CaptureFixture[str]
) -> None:
    points = np.vstack([bar.points, np.add(bar.points, [0.1, 0, 0])])
    cells = np.vstack([bar.cells["hexahedron20"], bar.cells["hexahedron20"] + bar.n_node])
    two = Mesh(points=points, cells={"hexahedron20": cells}, node_sets={"clamp": bar.nodes("clamp")})
    write_mesh(two, home / "two.vtu")
    assert main(["modes", "two.vtu", "--length-unit", "m", "--fix", "clamp", "--no-pictures"]) != 0
    told = capfd.readouterr().err
    assert "leave body 2 of 2" in told
    assert "Two bodies that touch" in told
    # One body that its supports leave loose has no other body to be joined to.
    assert main(["modes", "bar.inp", "--length-unit", "m", "--fix", "line", "--no-pictures"]) != 0
    assert "Two bodies" not in capfd.readouterr().err


def test_modes_warn_of_hexahedra_of_eight_nodes(home: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """The first frequency of this bar is 47 % too high."""
    linear = mesh_blocks([Block.box(((0, 0.1), (0, 0.01), (0, 0.01)), (6, 1, 1), {"u0": "clamp"})], HEX8)
    write_mesh(linear, home / "linear.vtu")
    words = ["modes", "linear.vtu", "--length-unit", "m", "--fix", "clamp", "--n-modes", "1", "--no-pictures"]
    assert main(words) == 0
    assert "8 nodes, which are too stiff in bending" in capfd.readouterr().err


def test_a_seam_of_nodes_that_are_not_merged_is_told(home: Path, bar: Mesh, capfd: pytest.CaptureFixture[str]) -> None:
    """Both halves are held, so that nothing else would show that they are two."""
    points = np.vstack([bar.points, bar.points * [-1, 1, 1]])
    mirrored = bar.cells["hexahedron20"][:, [1, 0, 3, 2, 5, 4, 7, 6, 8, 11, 10, 9, 12, 15, 14, 13, 17, 16, 19, 18]]
    cells = np.vstack([bar.cells["hexahedron20"], mirrored + bar.n_node])
    ends = np.concatenate([bar.nodes("end"), bar.nodes("end") + bar.n_node])
    middle = bar.nodes("clamp")
    joined = np.arange(len(points))
    joined[middle + bar.n_node] = middle
    sets = {"ends": ends, "left": middle, "right": middle + bar.n_node}
    for name, own_cells in (("parted.vtu", cells), ("merged.vtu", joined[cells])):
        write_mesh(Mesh(points=points, cells={"hexahedron20": own_cells}, node_sets=sets), home / name)
        words = ["modes", name, "--length-unit", "m", "--fix", "ends", "--n-modes", "1", "--no-pictures"]
        assert main(words) == 0
        told = capfd.readouterr().err
        assert (f"{len(middle)} pairs of coincident nodes" in told) == (name == "parted.vtu")
    for lines, is_told in (("", True), (LINE, False)):
        (home / "my.toml").write_text(PARTED + lines)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            read_case(home / "my.toml")
        assert any("pairs of coincident nodes" in str(item.message) for item in caught) == is_told


PARTED = (
    own("70 GPa").partition("[[structure.support]]")[0].replace("bar.inp", "parted.vtu")
    + '[[structure.support]]\non = ["ends"]\n'
    + '[[structure.boundary]]\nname = "left"\non = "left"\n[[structure.boundary]]\nname = "right"\non = "right"\n'
)
LINE = """\
[[line]]
name = "lap"
normal = { at = "left", other_at = "right", direction = "x" }
tangent = { at = "left", other_at = "right", direction = "y" }
normal_stiffness = "2 N/um"
tangential_stiffness = "1.5 N/um"
friction_coefficient = 0.3
preload = "11 N"
balanced_preload = true
"""
