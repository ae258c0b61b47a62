"""Unknown units of columns; a column with an unknown unit is never read in SI units."""

import re

from correlation.campaign.measurement_unit import find_root_units
from correlation.file.column import Column
from correlation.file.quantity import QUANTITIES, find_named_quantities
from correlation.file.unit_label import find_suffix, find_unit, looks_like_a_unit, names_no_unit, read_unit

#: Text in brackets that is not a unit: indices, points, axes, parts of complex numbers, conventions of amplitudes.
NO_UNITS = re.compile(
    r"[\d\s:,]*|[+-]?r?[xyz][+-]?|\d+[xyz]?[+-]?|[a-z]{0,2}\d{1,2}|real|re|imag|im|mag|magnitude|amplitude|amp|abs|"
    r"phase|rms|pp|p-p|pk|0-pk|peak",
    re.IGNORECASE,
)

#: Units of counts of an A/D converter, and of sample numbers.
COUNTS = re.compile(r"counts?|lsb|digits?|samples?|ticks?", re.IGNORECASE)
#: Units of a strain.
STRAINS = re.compile(r"(micro|[µμu]|m)?[- ]?strains?|[µμu]?ε|[µμu]e|[µμum]?m/m", re.IGNORECASE)
#: Largest length of a last word that is taken as a unit symbol; longer words may be units, too: "disp chain".
LONGEST_SYMBOL = 3


def find_written_unit(column: Column, name: str) -> str:
    """Unit of a column as written in the file, also if it is not understood: "C" for "Temperature (C)"."""
    return (column.unit or column.unit_label or find_unit(column.label or name).unit).strip()


def says_counts(column: Column, name: str) -> bool:
    """Whether the unit of a column is a count, of a converter or of samples."""
    return not column.unit and COUNTS.fullmatch(find_written_unit(column, name)) is not None


def says_strain(column: Column, name: str) -> bool:
    """Whether the unit of a column is that of a strain."""
    return STRAINS.fullmatch(find_written_unit(column, name)) is not None


def find_unknown_unit(column: Column, name: str) -> str:
    """Unit of a column as written in the file, if it is not understood; else empty.

    Parameters
    ----------
    column
        Column.
    name
        Its name within its table.
    """
    if column.unit or column.words:
        return ""
    if column.unit_label and not read_unit(column.unit_label, name=name):
        return "" if names_no_unit(column.unit_label) else column.unit_label
    result = find_unit(column.label or name)
    if not result.unit:
        return _find_unknown_symbol(name)
    if COUNTS.fullmatch(result.unit):
        return result.unit
    if names_no_unit(result.unit) or NO_UNITS.fullmatch(result.unit):
        return ""
    if result.sign == "[":
        return result.unit if re.search(r"[^\W\d_]", result.unit) else ""
    return result.unit if looks_like_a_unit(result.unit) or _may_measure(result.name, result.unit) else ""


def _find_unknown_symbol(name: str) -> str:
    """Last word of a name, if it is a unit of the quantity that the name states: "disp dm", "force_dyn"; else empty."""
    match = re.match(r"(.+?)[\s_]([^\s_]+)$", name)
    if match is None or find_suffix(name)[1]:
        return ""
    start, token = match.groups()
    short = len(token) <= LONGEST_SYMBOL and bool(find_named_quantities(start)) and _may_measure(start, token)
    return token if short or COUNTS.fullmatch(token) or looks_like_a_unit(token) else ""


def _may_measure(name: str, token: str) -> bool:
    """Whether a word is a unit of the quantity that the name states, also an uncommon one: "furlong", "Gal"."""
    try:
        dimension = find_root_units(token)[1]
    except ValueError:
        return False
    named = find_named_quantities(name) or set(QUANTITIES)
    return any(dimension == find_root_units(QUANTITIES[quantity][0])[1] for quantity in named)
