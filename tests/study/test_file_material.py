"""Material and supports that a mesh file carries, in a case of a part and in `stickslip modes`."""

import json
from pathlib import Path

import meshio
import numpy as np
import pytest

from casefile.errors import CaseError
from fe.element import HEX20
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
    write_mesh(bar, at_home / "bar.inp")
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
    assert "bar.inp carries the material ALLOY, 70 GPa, 0.33, 2700 kg/m^3 (read in N, m and s), whose young" in told
    (home / "my.toml").write_text(own("70 GPa"))
    read_case(home / "my.toml")
    assert "ALLOY" not in capfd.readouterr().err


@pytest.mark.parametrize(
    ("carried", "says"),
    [
        ("", "bar.inp carries no material: add"),
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
    found = []
    for more in ([], ["--young", "70 GPa", "--density", "2700 kg/m^3"], ["--young", "280 GPa"]):
        assert main([*words, *more, "--out", "out"]) == 0
        told = capfd.readouterr()
        found.append(json.loads(told.out)["frequency_hz"][0])
        assert [Path(file).name for file in json.loads(told.out)["files"]] == ["bar_modes.vtu"]
        assert ("carries a material of 70 GPa" in told.err) == ("280 GPa" in more)
    assert {file.name for file in (home / "out").iterdir()} == {"bar_modes.vtu"}
    assert found[1] == pytest.approx(found[0], rel=1e-12)
    # Frequencies grow with the root of the modulus.
    assert found[2] == pytest.approx(2 * found[0], rel=1e-9)
    assert main([*words, "--film", "1"]) != 0
    assert "--film 1 is a picture" in capfd.readouterr().err
