"""Dataset 58: a function at a degree of freedom, as text or (58b) with binary values."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from correlation.file.column import Column, Point
from correlation.file.number import read_numbers
from correlation.file.uff.binary_values import COMPLEX, SINGLE
from correlation.file.uff.dataset import Dataset
from correlation.file.uff.record import read_fields
from correlation.file.uff.units import FileUnits
from correlation.file.unit_label import names_no_unit, read_unit

FUNCTIONS = (
    "", "time", "auto spectrum", "cross spectrum", "frequency response", "transmissibility", "coherence",
    "auto correlation", "cross correlation", "power spectral density", "energy spectral density",
    "probability density", "spectrum", "cumulative frequency distribution", "peaks and valleys", "stress cycles",
    "strain cycles", "orbit", "mode indicator", "force pattern", "partial power", "partial coherence", "eigenvalue",
    "eigenvector", "shock response spectrum", "finite impulse response filter", "multiple coherence", "order function",
)  # fmt: skip
DATA_TYPES = {
    1: "general", 2: "stress", 3: "strain", 5: "temperature", 6: "heat flux", 8: "displacement", 9: "reaction force",
    11: "velocity", 12: "acceleration", 13: "excitation force", 15: "pressure", 16: "mass", 17: "time",
    18: "frequency", 19: "rotational speed", 20: "order",
}  # fmt: skip
#: Functions whose values have the unit of the ordinate, and functions whose values have the unit of a ratio.
PLAIN, RATIO = {"", "time", "spectrum", "order function"}, {"frequency response", "transmissibility"}
AXES = ("", "x", "y", "z", "rx", "ry", "rz")
POINTS = re.compile(
    r"\s*(\d+)\s+(-?\d+)\s+(-?\d+)\s+(-?\d+)\s+(\S*)\s+(-?\d+)\s+(-?\d+)\s+(\S*)\s+(-?\d+)\s+(-?\d+)\s*"
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Record58:
    """Function of one dataset with its own abscissa, before equal abscissas of a file are merged."""

    column: Column
    abscissa: NDArray[np.float64]
    abscissa_name: str
    abscissa_unit: str
    abscissa_label: str = ""


def read_58(dataset: Dataset, units: FileUnits) -> Record58:
    """Read one function.

    Parameters
    ----------
    dataset
        Dataset with lines or binary values.
    units
        Units of the file, for functions without a unit label.

    Raises
    ------
    CampaignError
        The header cannot be read, or the number of values is not that in the header.
    """
    function, response, reference = _read_points(dataset)
    kind, count, spacing, first, step, z = read_fields(dataset, 6, (10, 10, 10, 13, 13, 13), "iiieee")
    if kind not in SINGLE | {4, 6} or spacing not in {0, 1}:
        raise dataset.error(6, f"type of values {kind} must be 2, 4, 5 or 6, spacing {spacing} must be 0 or 1")
    if dataset.values is not None:
        abscissa, ordinate = dataset.values.abscissa, dataset.values.ordinate
    else:
        abscissa, ordinate = _read_text_values(dataset, int(kind), int(count), even=spacing == 1)
    if abscissa is None and len(ordinate) > 1 and not step:
        raise dataset.error(6, "the step of its abscissa is 0; export the file again")
    begin, by = float(first), float(step)
    if abscissa is None and not (isfinite(begin) and isfinite(by)):
        raise dataset.error(6, f"its abscissa begins at {begin:g} with steps of {by:g}; export the file again")
    x = begin + by * np.arange(len(ordinate), dtype=np.float64) if abscissa is None else abscissa
    axis, number, per = (_read_axis(dataset, row) for row in (7, 8, 9))
    facts = {f"line {row + 1}": dataset.text(row).strip() for row in range(5)}
    facts = {key: text for key, text in facts.items() if text and text.upper() != "NONE"}
    facts |= {"quantity": DATA_TYPES.get(number[0], ""), "per": DATA_TYPES.get(per[0], "")}
    facts |= {"label": number[1], "unit label": number[2], "z": f"{z:g}" if z else ""}
    name = f"58 #{dataset.number}" + (f" {_label(response)}/{_label(reference)}".rstrip("/") if response else "")
    column = Column(
        name=name.rstrip(),
        values=ordinate,
        unit=_find_unit(function, number, per, units),
        unit_label=next((label for *_, label in (number, per) if not names_no_unit(label)), ""),
        function=function,
        response=response,
        reference=reference,
        facts={key: text for key, text in facts.items() if text},
        where=dataset.where(),
    )
    # The data type is more reliable than a label, which users write.
    label = axis[1] if axis[1].upper() != "NONE" else ""
    named = {17: "time", 18: "frequency", 19: "rotational speed", 20: "order"}.get(axis[0]) or label or "abscissa"
    unit = _find_axis_unit(axis, units)
    if axis[0] == 0 and unit in {"Hz", "s"}:
        named = {"Hz": "frequency", "s": "time"}[unit]
    return Record58(column=column, abscissa=x, abscissa_name=named, abscissa_unit=unit, abscissa_label=axis[2])


def _read_points(dataset: Dataset) -> tuple[str, Point, Point | None]:
    """Type of the function, and its points of response and reference."""
    text = dataset.text(5)
    widths = (5, 10, 5, 10, 1, 10, 10, 4, 1, 10, 10, 4)
    fields: Sequence[Any]
    match = POINTS.fullmatch(text)
    try:
        fields = read_fields(dataset, 5, widths, "iiiittiittii")
        fields = [*fields[:4], *fields[5:8], *fields[9:]]
    except ValueError:
        if match is None:
            raise
        fields = [*match.groups()]
    kind = int(fields[0])
    if not 0 <= kind < len(FUNCTIONS):
        raise dataset.error(5, f"type of function {kind} is unknown; 1 is time, 4 a frequency response, 6 coherence")
    points = []
    for name, node, direction in (fields[4:7], fields[7:10]):
        if abs(int(direction)) > 6:
            raise dataset.error(5, f"direction {direction} is none of -6 to 6")
        named = "" if str(name).strip().upper() == "NONE" else str(name).strip()
        axis = AXES[abs(int(direction))]
        sign = ("-" if int(direction) < 0 else "+") if axis else ""
        points.append(Point(node=int(node) or None, direction=sign + axis, name=named))
    response, reference = points
    empty = reference.node is None and not reference.direction and not reference.name
    return FUNCTIONS[kind], response, None if empty else reference


def _label(point: Point | None) -> str:
    """Point in the notation of test programs: 12Z+."""
    if point is None:
        return ""
    where = str(point.node) if point.node is not None else point.name
    return f"{where}{point.direction[1:].upper()}{point.direction[:1]}"


def _read_axis(dataset: Dataset, row: int) -> tuple[int, str, str]:
    """Data type, label and unit label of an axis."""
    text = dataset.text(row)
    if not text.strip():
        return 0, "", ""
    fields = read_fields(dataset, row, (10, 5, 5, 5, 1, 20, 1, 20), "iiiitttt")
    return int(fields[0]), str(fields[5]), str(fields[7])


def _find_unit(function: str, number: tuple[int, str, str], per: tuple[int, str, str], units: FileUnits) -> str:
    """Unit of the ordinate by its label or data type, as a ratio for functions in `RATIO`; empty if it is unknown."""
    label = read_unit(number[2], name=number[1])
    above = _find_axis_unit(number, units)
    if function in RATIO and above:
        below = _find_axis_unit(per, units)
        whole = "/" in label and bool(below) and label.replace(" ", "").endswith((f"/{below}", f"/({below})"))
        if not below:
            return label if "/" in label or per[0] == 0 else ""
        return above if whole else f"({above})/({below})"
    return above if function in PLAIN or label else ""


def _find_axis_unit(axis: tuple[int, str, str], units: FileUnits) -> str:
    """Unit of an axis by its label, or by its data type if the label has no unit."""
    data_type, name, label = axis
    return read_unit(label, name=name) or (units.of_type(data_type) if names_no_unit(label) else "")


def _read_text_values(
    dataset: Dataset, kind: int, count: int, *, even: bool
) -> tuple[NDArray[np.float64] | None, NDArray[Any]]:
    """Abscissa, None if it is even, and ordinate of a dataset of text."""
    parts = 2 if kind in COMPLEX else 1
    needed = count * (parts + (not even))
    numbers = read_numbers(b"\n".join(dataset.lines[11:]))
    if numbers is None or len(numbers) < needed:
        numbers = _read_by_width(dataset, kind, even=even)
    surplus = len(numbers) - needed
    # Some programs fill the last line with zeros.
    if surplus < 0 or surplus >= 6 or (surplus and numbers[needed:].any()):
        raise dataset.error(
            6, f"says that {needed} numbers follow, but there are {len(numbers)}; is the file cut, or the count wrong?"
        )
    table = numbers[:needed].reshape(count, -1) if count else numbers[:0].reshape(0, parts + (not even))
    ordinate = table[:, -parts:]
    with np.errstate(invalid="ignore"):  # infinite numbers are kept here and refused where they are used
        values = ordinate[:, 0] + 1j * ordinate[:, 1] if parts == 2 else ordinate[:, 0]
    return None if even else table[:, 0], values


def _read_by_width(dataset: Dataset, kind: int, *, even: bool) -> NDArray[np.float64]:
    """Read numbers line by line, from fields of fixed width if they are not separated by blanks."""
    parts = 2 if kind in COMPLEX else 1
    if kind in SINGLE:
        widths = [13] * 6
    elif even:
        widths = [20] * 4
    else:
        widths = [13, *[20] * parts] * (2 if parts == 1 else 1)
    numbers: list[float] = []
    for row in range(11, len(dataset.lines)):
        text, apart = dataset.text(row).rstrip(), read_numbers(dataset.lines[row])
        if apart is not None:
            numbers.extend(apart.tolist())
            continue
        used = next((n for n in range(len(widths) + 1) if sum(widths[:n]) >= len(text)), len(widths))
        # A line that does not end with a field has lost characters.
        if len(text) != sum(widths[:used]):
            raise dataset.error(row, f'"{text.strip()[:80]}" are not {len(widths)} numbers; export the file again')
        numbers.extend(float(value) for value in read_fields(dataset, row, widths[:used], "e" * used))
    return np.array(numbers, dtype=np.float64)
