"""Conversion of the units in the files of a campaign to SI; `casefile.quantity` does this for case files.

Units are compared by root units, not by dimension alone, because an angle has no dimension: "deg" is not a ratio, and
60 rpm is 1 Hz.
"""

import difflib
import math
import re
from decimal import Decimal
from functools import cache
from typing import TYPE_CHECKING, Any, cast

from correlation.campaign.familiar_unit import find_familiar_root_units

if TYPE_CHECKING:
    import pint

NUMBER_AND_UNIT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")
#: Usual units of test benches and case files; a misspelt unit is compared with these.
FAMILIAR_UNITS = (
    "m", "mm", "um", "µm", "nm", "cm", "km", "inch", "N", "mN", "kN", "MN", "Pa", "kPa", "MPa", "GPa", "kg", "g", "mg",
    "tonne", "s", "ms", "us", "min", "Hz", "kHz", "rpm", "rad", "mrad", "deg", "percent", "J", "W", "g_n", "V", "mV",
)  # fmt: skip

#: Hint at the unit that is probably meant, by the wrong unit and the SI unit that is needed.
HINTS = {
    ("g", "m/s^2"): "; for the acceleration of gravity write g_n",
    ("mil", "m"): "; for a thousandth of an inch write thou",
    ("mils", "m"): "; for a thousandth of an inch write thou",
}
#: Units of readings with a sensitivity, beside volts: whole numbers of a converter, and strains.
COUNT, STRAIN = "count", "strain"
#: Source of readings in these units, and an example of a sensitivity.
RAW = {
    COUNT: ("counts of a converter", f"655.36 {COUNT}"),
    f"{COUNT}s": ("counts of a converter", f"655.36 {COUNT}"),
    STRAIN: ("a strain gauge", f"0.01 {STRAIN}"),
}


def find_si_factor(unit: str, si: str) -> float:
    """Factor from a unit to SI.

    Parameters
    ----------
    unit
        Unit in the file.
    si
        SI unit that is needed; for "Hz", rad/s is also accepted, as an angular frequency.

    Raises
    ------
    ValueError
        The unit is unknown or of another quantity; in words, with the remedy.
    """
    if unit == si:
        return 1.0
    factor, root = find_root_units(unit)
    wanted_factor, wanted = find_root_units(si)
    if root == wanted:
        return float(factor / wanted_factor)
    if si == "Hz" and root == find_root_units("rad/s")[1]:
        return float(factor) / (2 * math.pi)
    hint = HINTS.get((unit, si), "")
    if unit in RAW and si not in {"", "s", "Hz", "rad"}:
        reading, sensitivity = RAW[unit]
        hint = f'; for {reading} add a sensitivity such as "{sensitivity}/({si})"'
    needed = f'a unit such as "{si}" is needed' if si else "a bare number is needed"
    raise ValueError(f'"{unit}" is a unit of another quantity, {needed}{hint}')


def find_base_unit(unit: str) -> tuple[float, str]:
    """Factor to the SI unit of a time record, and the name of this unit, such as 0.001 and "V" for "mV"."""
    if unit in {"m", "m/s", "m/s^2", "s", "rad", "N", "V", "Hz"}:
        return 1.0, unit
    for si in ("m", "m/s", "m/s^2", "N", "V", "s", "rad", "Hz"):
        if find_root_units(unit)[1] == find_root_units(si)[1]:
            return find_si_factor(unit, si), si
    raise ValueError(f'"{unit}" is not a unit of a time record; give one such as "m", "m/s", "m/s^2", "N", "V" or "s"')


def read_si_quantity(value: object, si: str) -> float:
    """SI value of text such as "500 mm"; a ratio may be a bare number or "0.5 %".

    Raises
    ------
    ValueError
        The text is not a finite number with a unit of this quantity; in words, with the remedy.
    """
    example = f'"0.5 {si}"' if si else '"0.5 %"'
    if isinstance(value, str) and re.match(r"\s*[+-]?\d*,\d", value):
        raise ValueError(f"write a decimal point, not a comma, e.g. {example}")
    if isinstance(value, int | float) and not isinstance(value, bool) and not si:
        number, unit = float(value), ""
    elif isinstance(value, str) and (match := NUMBER_AND_UNIT.fullmatch(value)):
        number, unit = float(match[1]), match[2]
    else:
        raise ValueError(f"must be text with a number and a unit, e.g. {example}")
    if not unit and si:
        raise ValueError(f"give a unit, e.g. {example}")
    number *= find_si_factor(unit, si)
    if not math.isfinite(number):
        raise ValueError("is not a finite number")
    return number


def read_positive_si_quantity(value: object, si: str) -> float:
    """SI value of a positive quantity; see `read_si_quantity`.

    Raises
    ------
    ValueError
        The value is not positive, or as `read_si_quantity`; in words, with the remedy.
    """
    number = read_si_quantity(value, si)
    if not number > 0:
        raise ValueError("must be above zero")
    return number


@cache
def get_unit_registry() -> "pint.UnitRegistry[Decimal]":
    """Unit registry, made once per process: pint takes over half a second to import and to read its definitions."""
    import pint

    registry: pint.UnitRegistry[Decimal] = pint.UnitRegistry(non_int_type=Decimal)
    registry.define(f"{STRAIN} = []")  # a dimension of its own like a count, not a bare ratio
    return registry


@cache
def find_root_units(unit: str) -> tuple[Decimal, tuple[tuple[str, float], ...]]:
    """Factor to root units, and the root units as sorted (name, exponent) pairs.

    Raises
    ------
    ValueError
        The unit is unknown or cannot be read; in words, with the remedy.
    """
    if (familiar := find_familiar_root_units(unit)) is not None:
        return familiar
    import pint

    registry = get_unit_registry()
    try:
        factor, root = registry.get_root_units(registry.parse_units(unit))
    except pint.UndefinedUnitError as error:
        names = cast("Any", error).unit_names
        raise ValueError(_describe_unknown_unit(names if isinstance(names, str) else next(iter(names)), unit)) from None
    except Exception:  # Pint raises tokenizer, attribute and arithmetic errors of many kinds on malformed text.
        raise ValueError(f'cannot read the unit "{unit}"; write it like "N/um" or "m/s^2"') from None
    container = cast("Any", root)._units
    return Decimal(str(factor)), tuple(sorted((name, float(exponent)) for name, exponent in container.items()))


def _describe_unknown_unit(name: str, unit: str) -> str:
    same_letters = [known for known in FAMILIAR_UNITS if known.lower() == name.lower()]
    close = same_letters or difflib.get_close_matches(name, FAMILIAR_UNITS, 1, 0.5)
    if not close:
        return f'unknown unit "{name}"; units are written like N/um, m/s^2, deg'
    corrected = re.sub(rf"(?<!\w){re.escape(name)}(?!\w)", close[0], unit)
    return f'unknown unit "{name}"; did you mean "{corrected}"?'
