"""A slip of a unit is refused or doubted with the unit that was meant; all solids that exist pass."""

import warnings
from pathlib import Path

import pytest
from pydantic import TypeAdapter

from casefile.quantity import MATERIAL_DENSITY, YOUNGS_MODULUS, MaterialDensity, YoungsModulus, read_quantity
from casefile.table import CaseModel, load_case
from geometry.errors import InputWarning

ONE_OF_EACH = [
    ("5 MPa", "1100 kg/m^3"),  # rubber
    ("50 kPa", "30 kg/m^3"),  # soft foam
    ("3 GPa", "1.2 g/cm^3"),  # plastic
    ("411 GPa", "19300 kg/m^3"),  # tungsten
    ("1.22 TPa", "3515 kg/m^3"),  # diamond
    ("546 GPa", "22590 kg/m^3"),  # osmium
]


class Material(CaseModel):
    young: YoungsModulus
    density: MaterialDensity | None = None


class Case(CaseModel):
    material: list[Material]


@pytest.mark.parametrize(("young", "density"), ONE_OF_EACH)
def test_no_solid_is_refused(young: str, density: str) -> None:
    read_quantity(young, YOUNGS_MODULUS)
    read_quantity(density, MATERIAL_DENSITY)


@pytest.mark.parametrize(
    ("text", "kind", "meant"),
    [
        ("7800 kg/mm^3", MaterialDensity, "7800 kg/m^3"),
        ("7800 g/cm^3", MaterialDensity, "7800 kg/m^3"),
        ("7.8e-9 kg/m^3", MaterialDensity, "7.8e-9 tonne/mm^3"),
        ("210 Pa", YoungsModulus, "210 GPa"),
        ("210000 GPa", YoungsModulus, "210000 MPa"),
        ("2.1e11 GPa", YoungsModulus, "2.1e11 Pa"),
    ],
)
def test_what_no_solid_has_is_refused_with_the_unit_that_was_meant(text: str, kind: object, meant: str) -> None:
    with pytest.raises(ValueError, match="beyond any solid") as refused:
        TypeAdapter(kind).validate_python(text)
    assert f'did you mean "{meant}"?' in str(refused.value)


@pytest.mark.parametrize("text", ["1e30 GPa", "1e-30 Pa"])
def test_a_number_that_no_unit_mends_gets_no_suggestion(text: str) -> None:
    with pytest.raises(ValueError, match="check its number and its unit") as refused:
        read_quantity(text, YOUNGS_MODULUS)
    assert "did you mean" not in str(refused.value)


def case_file(folder: Path, young: str, density: str) -> Path:
    file = folder / "my.toml"
    table = f'[[material]]\nyoung = "{young}"\ndensity = "{density}"\n'
    file.write_text(f'schema = 2\n[[material]]\nyoung = "210 GPa"\n{table}')
    return file


def test_an_unusual_value_is_used_with_a_warning_that_names_line_value_and_likely_unit(tmp_path: Path) -> None:
    with pytest.warns(InputWarning) as caught:
        case = load_case(case_file(tmp_path, "210 MPa", "7800 kg/m^3"), Case)
    assert case.material[1].young == 210e6
    (message,) = [str(item.message) for item in caught]
    assert message.startswith(f'{tmp_path / "my.toml"}:5: material[1].young = "210 MPa": ')
    assert message.endswith('did you mean "210 GPa"?')


def test_a_metal_is_not_doubted(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load_case(case_file(tmp_path, "70 GPa", "2700 kg/m^3"), Case)


def test_a_sign_is_left_to_the_material_itself() -> None:
    assert read_quantity("-210 GPa", YOUNGS_MODULUS) == -210e9
