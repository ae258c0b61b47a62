"""The table of keys of joints in docs/case.md has what the laws say of their parameters."""

import re
from pathlib import Path
from typing import NamedTuple

import pint
import pytest

from reduction.joint_law.registry import LAWS, LawParameter

PAGE = Path(__file__).parents[2] / "docs" / "case.md"
HEAD = "| key | kinds | meaning | unit, e.g. | value | default |"
UNITS: pint.UnitRegistry[float] = pint.UnitRegistry()


class Entry(NamedTuple):
    unit: str
    value: str
    default: str


def entries() -> dict[tuple[str, str], Entry]:
    """Of each kind and key."""
    lines = PAGE.read_text(encoding="utf-8").split(HEAD)[1].strip().split("\n\n")[0].splitlines()[1:]
    result: dict[tuple[str, str], Entry] = {}
    for line in lines:
        keys, kinds, _, unit, value, default = (cell.strip() for cell in line.strip("|").split("|"))
        for kind in re.findall(r"`(\w+)`", kinds):
            for key in re.findall(r"`(\w+)`", keys):
                assert (kind, key) not in result, line
                # What stands behind a semicolon is beside other keys.
                result[kind, key] = Entry(unit.strip("`"), value.split(";")[0], default)
    return result


def expected_value(parameter: LawParameter) -> str:
    least = "> 0" if parameter.positive else f">= {parameter.lower:g}" if parameter.lower > -float("inf") else "any"
    return least if parameter.plausible is None else f"{least}, at most {parameter.plausible.largest:g}"


#: Other tests may register laws from outside.
OWN = {law.kind: law for law in LAWS if law.__module__.startswith("reduction.joint_law.")}


@pytest.mark.parametrize("kind", sorted(OWN))
def test_each_parameter_of_a_law_has_its_bounds_and_default_in_the_table(kind: str) -> None:
    table = entries()
    assert {key for law, key in table if law == kind} == {parameter.name for parameter in OWN[kind].parameters}
    for parameter in OWN[kind].parameters:
        entry = table[kind, parameter.name]
        assert entry.value == expected_value(parameter), parameter.name
        assert entry.default == ("" if parameter.default is None else f"{parameter.default:g}"), parameter.name
        own = UNITS.dimensionless if parameter.unit == "-" else UNITS.parse_units(parameter.unit.replace(" ", "*"))
        assert UNITS.parse_units(entry.unit or "").dimensionality == own.dimensionality, parameter.name


def test_the_table_names_no_other_laws() -> None:
    assert {kind for kind, _ in entries()} == set(OWN)
