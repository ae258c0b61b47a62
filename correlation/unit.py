"""Units at the door of a campaign: what stands in its files becomes SI.

Compared by root units, not by dimension alone, because an angle has none: "deg" is no ratio, and 60 rpm is 1 Hz.
"""

import difflib
import math
import re
from decimal import Decimal
from functools import cache
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    import pint

NUMBER_AND_UNIT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")
#: What test benches write; a misspelt unit is compared with these.
FAMILIAR_UNITS = (
    "m", "mm", "um", "µm", "nm", "cm", "inch", "N", "mN", "kN", "s", "ms", "us", "Hz", "kHz", "rpm", "rad/s", "rad",
    "mrad", "deg", "m/s", "mm/s", "m/s^2", "mm/s^2", "g_n", "V", "mV", "%",
)  # fmt: skip
_MEANS = {"%": "percent"}


def si_factor(unit: str, si: str) -> float:
    """What a value in a unit is multiplied by to become SI.

    Parameters
    ----------
    unit
        As in the file.
    si
        SI unit that is needed; for "Hz" also rad/s is taken, as an angular frequency.

    Raises
    ------
    ValueError
        The unit is unknown, or one of another quantity; in words, with the remedy.
    """
    # Pint takes half a second to import: most campaigns are written in SI and do without.
    if unit == si:
        return 1.0
    factor, root = _root(unit)
    wanted_factor, wanted = _root(si)
    if root == wanted:
        return float(factor / wanted_factor)
    if si == "Hz" and root == _root("rad/s")[1]:
        return float(factor) / (2 * math.pi)
    hint = "; for the acceleration of gravity write g_n" if unit == "g" and si == "m/s^2" else ""
    needed = f'a unit such as "{si}" is needed' if si else "a bare number is needed"
    raise ValueError(f'"{unit}" is a unit of another quantity, {needed}{hint}')


def base_unit(unit: str) -> tuple[float, str]:
    """Factor to SI base units, and their name: ("mV" -> 0.001 "V" in base units of mass, length, time, current)."""
    if unit in {"m", "m/s", "m/s^2", "s", "rad", "N", "V", "Hz"}:
        return 1.0, unit
    for si in ("m", "m/s", "m/s^2", "N", "V", "s", "rad", "Hz"):
        if _root(unit)[1] == _root(si)[1]:
            return si_factor(unit, si), si
    raise ValueError(f'"{unit}" is no unit of a time record; give one such as "m", "m/s", "m/s^2", "N", "V" or "s"')


def si_quantity(value: object, si: str) -> float:
    """SI value of text such as "500 mm"; a ratio may be a bare number or "0.5 %".

    Raises
    ------
    ValueError
        It is not a finite number with a unit of this quantity; in words, with the remedy.
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
    number *= si_factor(unit, si)
    if not math.isfinite(number):
        raise ValueError("is not a finite number")
    return number


@cache
def _registry() -> "pint.UnitRegistry[Decimal]":
    import pint

    return pint.UnitRegistry(non_int_type=Decimal)


@cache
def _root(unit: str) -> tuple[Decimal, tuple[tuple[str, float], ...]]:
    """Factor to root units, and those units as sorted (name, exponent) pairs."""
    import pint

    registry = _registry()
    try:
        factor, root = registry.get_root_units(registry.parse_units(_MEANS.get(unit, unit)))
    except pint.UndefinedUnitError:
        raise ValueError(f'unknown unit "{unit}"{_did_you_mean(unit)}') from None
    except Exception:  # Pint raises tokenizer, attribute and arithmetic errors of many kinds on malformed text.
        raise ValueError(f'cannot read the unit "{unit}"; write it like "um" or "m/s^2"') from None
    container = cast("Any", root)._units
    return Decimal(str(factor)), tuple(sorted((name, float(exponent)) for name, exponent in container.items()))


def _did_you_mean(unit: str) -> str:
    same_letters = [known for known in FAMILIAR_UNITS if known.lower() == unit.lower()]
    close = same_letters or difflib.get_close_matches(unit, FAMILIAR_UNITS, 1, 0.5)
    return f'; did you mean "{close[0]}"?' if close else "; units are written like um, mm/s, m/s^2, N"
