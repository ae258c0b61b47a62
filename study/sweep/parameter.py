"""Parameters of a case by the user's names, such as kt, wall.preload or structure.damping.ratio.

A value of a parameter is a value in the case file: `[calibrated]` contains the factors kt, kn, mu, zeta, E and bearing;
every other name is a table and its key.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from casefile.errors import CaseError, Problem
from casefile.source import dotted, find_value
from casefile.table import CaseModel
from casefile.validation import did_you_mean
from casefile.variation import vary_case
from geometry.errors import InputError
from geometry.toml_position import Path
from study.case.setup import ReadCase
from study.case.tables import CalibratedTable
from study.kind.registry import OpenCase

#: Factors on values of the case, the keys of `[calibrated]`.
FACTORS = tuple(CalibratedTable.model_fields)
#: Tables whose numbers may vary; other tables are for requested results or for measurements.
TABLES = (
    "structure", "place", "line", "joint", "load", "static_load", "dead_weight", "sensor", "harmonics", "added",
    "calibrated",
)  # fmt: skip
#: Lists whose tables have names, and the key of the name.
NAMED = {"line": "name", "joint": "name", "dead_weight": "name", "sensor": "name", "place": "name", "added": "effect"}


class ParameterError(InputError):
    """A parameter is not in the case, or has invalid values."""


@dataclass(frozen=True, kw_only=True)
class CaseParameter:
    """A number of a case.

    Parameters
    ----------
    name
        Name given by the user.
    path
        Path of the key in the case.
    unit
        Unit of the values, "" for a ratio.
    """

    name: str
    path: Path
    unit: str = ""

    @property
    def is_factor(self) -> bool:
        """Whether the values are factors on values of the case."""
        return self.path[0] == "calibrated"

    @property
    def label(self) -> str:
        """Label of an axis or a column."""
        return f"{'factor ' if self.is_factor else ''}{self.name} [{self.unit or '-'}]"

    def text(self, value: float) -> str:
        """Format name and value for reports."""
        return f"{self.name} = {value:.6g}{f' {self.unit}' if self.unit else ''}"

    def written(self, value: float, *, whole: bool = False) -> object:
        """Return the entry of a case file for a value."""
        number = int(value) if whole else float(value)
        return f"{number!r} {self.unit}" if self.unit else number


def find_parameter(opened: OpenCase, name: str, unit: str = "") -> CaseParameter:
    """Find the parameter of a name.

    Parameters
    ----------
    opened
        Case with the parameter.
    name
        Factor, or table and key: ``kt``, ``wall.preload`` of the line "wall", ``structure.damping.ratio``,
        ``load[0].amplitude``.
    unit
        Unit of the values.

    Raises
    ------
    ParameterError
        There is no such table, or the name is that of a table.
    """
    assert opened.case.source is not None
    data = opened.case.source.data
    if name in FACTORS:
        return CaseParameter(name=name, path=("calibrated", name), unit=unit)
    path = _find_path(data, name)
    if path is None or path[0] not in TABLES:
        if path is not None and str(path[0]) in type(opened.case).model_fields:
            raise ParameterError(
                "this is not a number of the structure, its joints or its loads: change it in the case"
            )
        near = did_you_mean(name, [*FACTORS, *_list_names(data)])
        remedy = near or f"; give a factor ({', '.join(FACTORS)}) or a key of a table, such as {_find_example(data)}"
        raise ParameterError(f"the case has no such parameter{remedy}")
    _require_way(data, path)
    if isinstance(find_value(data, path), Mapping) or len(path) < 2:
        raise ParameterError(
            f"this is a table: name one of its keys, such as {name}.{_find_key(find_value(data, path))}"
        )
    return CaseParameter(name=name, path=path, unit=unit)


def _require_way(data: Mapping[str, Any], path: Path) -> None:
    """Refuse a path through a value without keys, or to an index outside a list."""
    for length, part in enumerate(path[1:], start=1):
        parent, stem = find_value(data, path[:length]), path[length - 1]
        if parent is None:
            return
        if isinstance(part, int) and isinstance(parent, list) and part >= len(parent):
            raise ParameterError(f"the list has {len(parent)} entries: give a number from 0 to {len(parent) - 1}")
        if not isinstance(parent, list if isinstance(part, int) else Mapping):
            raise ParameterError(f"{stem} is a single value without keys: name {stem} itself")


def require_factors(read: ReadCase, parameters: tuple[CaseParameter, ...]) -> None:
    """Refuse factors that are not calibration parameters of the case.

    Raises
    ------
    CaseError
        A factor has no effect, such as kt in a case without contact lines.
    """
    known = [item.name for item in read.setup.calibration_parameters]
    opened = read.opened
    assert opened.case.source is not None
    for item in parameters:
        if item.is_factor and item.path[1] not in known:
            remedy = f"give one of {', '.join(known)}, or" if known else "give"
            raise refuse(
                opened,
                item.name,
                f"{item.name}: it is a factor on all contact lines, on the damping or on the stiffness, but the case "
                f"has nothing that it scales, or takes it as known in [accepted]: {remedy} a key of a table, such as "
                f"{_find_example(opened.case.source.data)}",
            )


def refuse(opened: OpenCase, key: str, text: str) -> CaseError:
    """Make the error of a request that is not in the case file."""
    return CaseError([Problem(file=str(opened.path), line=0, key=key, text=text)])


def vary(opened: OpenCase, values: Mapping[CaseParameter, object]) -> OpenCase:
    """Make the case with other values of parameters.

    Raises
    ------
    CaseError
        A value is invalid for the case.
    """
    case: CaseModel = vary_case(opened.case, {item.path: value for item, value in values.items()})
    return replace(opened, case=case)  # type: ignore[arg-type]


def _find_path(data: Mapping[str, Any], name: str) -> Path | None:
    """Find the path of a name; None if it does not start with a table of the case."""
    for table, key in NAMED.items():
        for number, entry in enumerate(data.get(table, ())):
            own = entry.get(key) if isinstance(entry, Mapping) else None
            if own and name.startswith(f"{own}."):
                return (table, number, *_split_path(name[len(str(own)) + 1 :]))
    path = _split_path(name)
    known = path[:2] if len(path) > 1 and isinstance(path[1], int) else path[:1]
    # [harmonics] may be missing in the file: it has defaults.
    return path if path and (find_value(data, known) is not None or path[0] == "harmonics") else None


def _split_path(text: str) -> Path:
    """Split dotted text with indices in brackets into a path; empty for any other text."""
    path: list[str | int] = []
    for part in text.split("."):
        match = re.fullmatch(r"([^\[\]]+)(?:\[(\d+)\])?", part)
        if match is None:
            return ()
        path += [match[1]] if match[2] is None else [match[1], int(match[2])]
    return tuple(path)


def _list_names(data: Mapping[str, Any]) -> Iterator[str]:
    """Yield the names of numbers in named tables and in the structure."""
    for table, key in NAMED.items():
        for entry in data.get(table, ()):
            if isinstance(entry, Mapping):
                yield from (f"{entry.get(key)}.{item}" for item, value in entry.items() if _is_number(value))
    yield from _list_within(data.get("structure"), ("structure",))


def _list_within(table: object, path: Path) -> Iterator[str]:
    if isinstance(table, Mapping):
        for key, value in table.items():
            if _is_number(value):
                yield dotted((*path, key))
            yield from _list_within(value, (*path, key))


def _is_number(value: object) -> bool:
    """Whether a value of a file is a number or a quantity."""
    if isinstance(value, str):
        return bool(re.match(r"\s*[+-]?\.?\d", value))
    return isinstance(value, int | float) and not isinstance(value, bool)


def _find_example(data: Mapping[str, Any]) -> str:
    return next(_list_names(data), "structure.damping.ratio")


def _find_key(table: object) -> str:
    return next((key for key, value in table.items() if _is_number(value)), "KEY") if isinstance(table, Mapping) else ""
