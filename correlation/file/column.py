"""Content of a test file: named columns, nodes and measured shapes, in the units of the file."""

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from correlation.errors import CampaignError
from correlation.file.unit_label import split_label

Node = Float[NDArray[np.float64], "3"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Point:
    """Point of measurement or excitation.

    Parameters
    ----------
    node
        Number of the node; None if the file gives none.
    direction
        "+x", "-rz" and the like; empty if it is unknown or the quantity has no direction.
    name
        Name of the channel or part.
    """

    node: int | None
    direction: str
    name: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class Column:
    """One quantity of a file, in the unit of the file.

    Parameters
    ----------
    name
        Name, unique within the file.
    values
        Real or complex values, shape (n,); NaN where a field is empty.
    unit
        Unit as text for `correlation.campaign.measurement_unit`; empty if it is unknown.
    label
        Name and unit as in the file, if `name` does not include both.
    unit_label
        Label of the unit in the file, also if it is not understood; empty if the unit is only part of the name.
    abscissa
        Name of the column of its abscissa; None if the file does not state it.
    function
        "time", "frequency response", "coherence" and the like; empty if it is unknown.
    response, reference
        Points of measurement and of excitation.
    facts
        Other facts of the file: date, sampling rate, text of the identification lines.
    where
        Place in the file for messages, such as "dataset 3, line 120".
    words
        For a column of text, its different words; `values` are then indices into them.
    """

    name: str
    values: NDArray[Any]
    unit: str = ""
    label: str = ""
    unit_label: str = ""
    abscissa: str | None = None
    function: str = ""
    response: Point | None = None
    reference: Point | None = None
    facts: Mapping[str, str] = field(default_factory=dict)
    where: str = ""
    words: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        kind = np.complex128 if np.iscomplexobj(self.values) else np.float64
        values = np.asarray(self.values, dtype=kind).reshape(-1).view()  # no copy: columns may have 1e6 rows
        values.setflags(write=False)
        object.__setattr__(self, "values", values)


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredShape:
    r"""Values at the nodes of a structure: a mode shape, or a deflection shape at one frequency.

    Parameters
    ----------
    kind
        "normal mode", "complex mode", "frequency response", "static" and the like.
    frequency
        Natural or excitation frequency [Hz]; NaN if there is none; :math:`|\lambda| / 2 \pi` for a complex mode.
    damping_ratio
        Viscous damping ratio [-]; NaN if the file gives none.
    nodes
        Numbers of the nodes, shape (n,).
    values
        Values x, y, z, rx, ry, rz, real or complex, shape (n, 1 to 6) [unit].
    unit
        Unit of the values; empty if it is unknown.
    facts
        Identification lines and parameters.
    where
        Place in the file.
    """

    kind: str
    frequency: float
    damping_ratio: float
    nodes: NDArray[np.int64]
    values: NDArray[Any]
    unit: str = ""
    facts: Mapping[str, str] = field(default_factory=dict)
    where: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredFile:
    """Content of a file of a test program.

    Parameters
    ----------
    path
        Path of the file.
    format
        Name of its format.
    title
        Title in the file; empty if there is none.
    columns
        Columns in the order of the file.
    nodes
        Coordinates of nodes by their numbers, each of shape (3,) [m].
    shapes
        Measured shapes.
    facts
        Facts that apply to the whole file.
    """

    path: Path
    format: str
    title: str = ""
    columns: tuple[Column, ...] = ()
    nodes: Mapping[int, Node] = field(default_factory=dict)
    shapes: tuple[MeasuredShape, ...] = ()
    facts: Mapping[str, str] = field(default_factory=dict)

    def column(self, name: str) -> Column:
        """Find a column by its name; the unit at the end of a header may be left out.

        Raises
        ------
        CampaignError
            There is no such column, or several differ only by their units; the message lists close names.
        """
        exact = [column for column in self.columns if column.name == name]
        matching = exact or [column for column in self.columns if split_label(column.name)[0] == name]
        if len(matching) == 1:
            return matching[0]
        names = [column.name for column in self.columns]
        if matching:
            listed = ", ".join(f'"{column.name}"' for column in matching)
            raise CampaignError(f'{self.path.name}: the column "{name}" may be {listed}: write its whole name')
        lower = {known.lower(): known for known in names}
        close = [lower[key] for key in difflib.get_close_matches(name.lower(), lower, 3, 0.5)]
        listed = ", ".join(f'"{known}"' for known in close or names[:12])
        more = f" and {len(names) - 12} more" if not close and len(names) > 12 else ""
        choice = f"did you mean {listed}?" if close else f"it has {listed or 'no columns'}{more}"
        raise CampaignError(f'{self.path.name}: has no column "{name}"; {choice}')


def make_unique_names(names: Sequence[str], numbered: str = "{} ({})") -> list[str]:
    """Make names unique: a repeated name gets the number of its occurrence, such as "acc (2)"."""
    taken: set[str] = set()
    unique: list[str] = []
    for name in names:
        number, candidate = 1, name
        while candidate in taken:
            number += 1
            candidate = numbered.format(name, number)
        taken.add(candidate)
        unique.append(candidate)
    return unique
