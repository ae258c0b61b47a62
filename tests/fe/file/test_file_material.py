"""The material that a mesh file carries: decks of Abaqus and CalculiX, and Nastran's MAT1 in its three layouts."""

from pathlib import Path

import pytest

from fe.errors import MeshError
from fe.file.file_material import describe_material, list_differences, read_file_material
from fe.material import Material

#: The same steel in N, mm and s.
STEEL = Material(young=206e9, poisson=0.29, density=7850.0)
SECTION = "*SOLID SECTION, ELSET=ALL, MATERIAL=Steel\n"
DECK = "*NODE\n1, 0, 0, 0\n*MATERIAL, NAME=STEEL\n*ELASTIC\n206000., 0.29\n*DENSITY\n7.85e-9\n"
SMALL = "MAT1           3 206000.            0.29 7.85-9\n"
LARGE = "MAT1*                  3         206000.                            0.29\n*                7.85E-9\n"
FREE = "MAT1,3,206000.,,.29,7.85e-9\n"


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.inp", DECK + SECTION),
        ("a.inp", DECK.lower() + "** nothing else\n" + "*Material, name=glue\n*Elastic\n1., 0.4\n" + SECTION),
        ("a.bdf", "BEGIN BULK\nPSOLID,1,3\n" + SMALL + "MAT1,9,1.,,.4,1.\nENDDATA\n"),
        ("a.nas", "BEGIN BULK\n" + LARGE + "ENDDATA\n"),
        ("a.bdf", "BEGIN BULK\n" + FREE + "ENDDATA\n"),
        ("a.bdf", "BEGIN BULK\nMAT1,3,206000.,79844.961,,7.85e-9\nENDDATA\n"),
        ("a.bdf", "BEGIN BULK\nPARAM,WTMASS,1.-3\nMAT1,3,206000.,,.29,7.85e-6\nENDDATA\n"),
    ],
    ids=["deck", "unused material", "fields of 8", "fields of 16", "commas", "shear modulus", "unit of mass"],
)
def test_the_material_of_the_solid_cells_is_read_in_its_units(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)
    carried = read_file_material(tmp_path / name, 1e-3)
    assert carried.material is not None
    assert carried.name.upper() in {"STEEL", "3"}
    # Digits of the files, the shear modulus has eight.
    for value in ("young", "poisson", "density"):
        assert getattr(carried.material, value) == pytest.approx(getattr(STEEL, value), rel=1e-7)
    assert list_differences(STEEL, carried.material) == []
    assert list_differences(Material(young=70e9, poisson=0.29, density=2700.0), carried.material) == [
        "young",
        "density",
    ]


def test_a_deck_in_inches_has_its_moduli_in_psi(tmp_path: Path) -> None:
    # Density in lbf s^2 / in^4; 206 GPa and 7850 kg/m^3 to the digits that are given.
    text = DECK.replace("206000.", "2.9877774e7").replace("7.85e-9", "7.345445e-4") + SECTION
    (tmp_path / "a.inp").write_text(text)
    material = read_file_material(tmp_path / "a.inp", 0.0254).material
    assert material is not None
    assert material.young == pytest.approx(STEEL.young, rel=1e-6)
    assert material.density == pytest.approx(STEEL.density, rel=1e-6)
    assert describe_material(material, 0.0254).endswith("7850 kg/m^3 (read in lbf, inch and s)")


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.inp", DECK + "*MATERIAL, NAME=GLUE\n*ELASTIC\n1., .4\n*DENSITY\n1e-9\n", 'materials "STEEL" and "GLUE"'),
        ("a.inp", DECK.replace("*DENSITY\n7.85e-9\n", ""), 'material "STEEL" has no density'),
        ("a.inp", DECK.replace("0.29\n", "0.29, 20.\n150000., 0.3, 400.\n"), "depends on temperature"),
        ("a.inp", DECK.replace("*ELASTIC", "*ELASTIC, TYPE=ENGINEERING CONSTANTS"), "is not isotropic"),
        ("a.bdf", "BEGIN BULK\nMAT9,3,1.,1.\nENDDATA\n", "MAT9, which is not isotropic"),
    ],
)  # fmt: skip
def test_a_material_that_a_part_cannot_have_is_named_with_its_obstacle(
    tmp_path: Path, name: str, text: str, says: str
) -> None:
    (tmp_path / name).write_text(text)
    carried = read_file_material(tmp_path / name, 1e-3)
    assert carried.material is None
    assert says in carried.obstacle


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.inp", DECK.replace("206000., 0.29", "206000."), r'the \*ELASTIC of material "STEEL" is truncated'),
        ("a.inp", DECK.replace("206000.", "hard"), r'the \*ELASTIC of material "STEEL" is truncated or not numeric'),
        ("a.inp", DECK.replace("0.29", "0.7"), r'material "STEEL": poisson = 0.7 must lie between'),
        ("a.bdf", "BEGIN BULK\nMAT1,3,hard,,.3,1.\nENDDATA\n", "MAT1 3 cannot be read"),
        ("a.bdf", f"BEGIN BULK\nINCLUDE '{'x' * 300}'\nENDDATA\n", r"a\.bdf cannot be opened \(.*name too long\)"),
    ],
)
def test_a_damaged_material_is_one_sentence(tmp_path: Path, name: str, text: str, says: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(MeshError, match=says):
        read_file_material(tmp_path / name, 1e-3)


def test_a_file_without_a_material_has_none(tmp_path: Path) -> None:
    (tmp_path / "a.inp").write_text("*NODE\n1, 0, 0, 0\n")
    (tmp_path / "a.msh").write_text("$MeshFormat\n")
    for name in ("a.inp", "a.msh", "missing.inp", "a.xyz"):
        carried = read_file_material(tmp_path / name, 1.0)
        assert carried.material is None
        assert not carried.obstacle
