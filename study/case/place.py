"""Places of joints, loads, sensors and effects of a case: rows over the structure's degrees of freedom.

A place is given by one of six keys. ``dof`` is the index of a degree of freedom, from 0 (relative to ``other``, if
given); ``weights`` gives the row itself. ``at`` names a boundary set of a reduced model, with a ``direction``: one row
per station, or only the row of one ``station``. ``node`` names a node of the table of degrees of freedom, ``row`` a row
that the structure stores by name, ``place`` a named place of the case or of its structure.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from casefile.table import CaseModel
from casefile.validation import did_you_mean
from correlation.errors import ModelDefinitionError
from correlation.model import Dof
from reduction.errors import JointError
from reduction.file.structure_file import StructureMatrices
from reduction.jointed_system import along, between
from reduction.rom import ReducedModel

Row = Float[NDArray[np.float64], " r"]
DofNumber = Annotated[int, Field(ge=0, strict=True, examples=[3])]
Axis = Literal["x", "y", "z", "rx", "ry", "rz"]
Direction = Annotated[
    Annotated[Axis, Tag("axis")] | Annotated[tuple[float, float, float], Tag("vector")],
    Discriminator(lambda value: "axis" if isinstance(value, str) else "vector"),
]

WAYS = ("dof", "weights", "at", "node", "row", "place")
#: Further keys that each key of `WAYS` allows.
COMPANIONS = {
    "dof": {"other"},
    "weights": set[str](),
    "at": {"other_at", "station", "direction"},
    "node": {"body", "direction"},
    "row": set[str](),
    "place": set[str](),
}
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
#: Largest relative difference of two sums that rounding causes [-].
ROUNDING = 1e-9
#: Largest number of names in a message.
MOST_LISTED = 12


class PlaceTable(CaseModel):
    """Table of a place and a direction."""

    #: Further keys that may give the place, beside `WAYS`.
    also: ClassVar[tuple[str, ...]] = ()

    dof: DofNumber | None = None
    other: DofNumber | None = None
    weights: Annotated[dict[Annotated[int, Field(ge=0)], float] | None, Field(examples=[{"3": 1.0, "5": -1.0}])] = None
    at: str | None = None
    other_at: str | None = None
    station: Annotated[int, Field(ge=0, strict=True)] | None = None
    body: str | None = None
    node: Annotated[int, Field(strict=True)] | None = None
    direction: Annotated[Direction | None, Field(examples=["x"])] = None
    row: Annotated[str | None, Field(examples=["tip"])] = None
    place: str | None = None

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        ways = [name for name in (*WAYS, *self.also) if getattr(self, name) is not None]
        if len(ways) != 1:
            reason = f"{' and '.join(ways)} are given" if ways else "no position is given"
            raise ValueError(f"{reason}: give one of {', '.join((*WAYS, *self.also))}")
        (way,) = ways
        for key in ("other", "other_at", "station", "body", "direction"):
            if getattr(self, key) is not None and key not in COMPANIONS.get(way, set()):
                goes = " or ".join(item for item in WAYS if key in COMPANIONS[item])
                raise ValueError(f"{key} = {getattr(self, key)} belongs to {goes}, not to {way}: remove one of them")
        if self.node is not None and not isinstance(self.direction, str):
            raise ValueError(f'node = {self.node} needs a direction, e.g. direction = "z"')
        if self.at is not None:
            self._check_direction()
        if self.weights is not None and not any(self.weights.values()):
            raise ValueError("its weights are empty or all zero: give at least one, e.g. weights = {3 = 1.0, 5 = -1.0}")
        return self

    def _check_direction(self) -> None:
        if self.direction is None:
            raise ValueError(f'at = "{self.at}" needs a direction, e.g. direction = "x" or [0.6, 0.0, 0.8]')
        if isinstance(self.direction, str) and self.direction not in AXES:
            raise ValueError(f'direction = "{self.direction}" is only for a node: give "x", "y", "z" or a vector')
        if isinstance(self.direction, tuple) and not any(self.direction):
            raise ValueError("direction = [0, 0, 0] is not a direction: give three components, e.g. [0.6, 0.0, 0.8]")


def listed(value: Any) -> Any:
    """Turn a single entry into a list of one."""
    return value if isinstance(value, list | tuple) else [value]


#: One place, or a list of them.
Places = Annotated[tuple[PlaceTable, ...], BeforeValidator(listed), Field(min_length=1)]


@dataclass(frozen=True, kw_only=True, eq=False)
class PlaceFinder:
    """Finder of the rows of the places of a case.

    Parameters
    ----------
    matrices
        Matrices of the structure, with the reduced model if they come from one.
    dofs
        Description of each of the r degrees of freedom.
    stored
        Rows that the structure stores, shape (r,) or (n, r), by name.
    places
        Rows of the structure and of the case, shape (r,), by name.
    """

    matrices: StructureMatrices
    dofs: Sequence[Dof]
    stored: Mapping[str, NDArray[np.float64]]
    places: dict[str, Row] = field(default_factory=dict)

    def rows(self, place: PlaceTable) -> list[Row]:
        """Return one row per station of a place; only ``at`` and ``row`` can give more than one row.

        Raises
        ------
        ModelDefinitionError, JointError, RomError
            A name, number, direction or station that the structure does not have.
        """
        n_dof = self.matrices.n_dof
        if place.dof is not None:
            return [between(n_dof, place.dof, place.other)]
        if place.weights is not None:
            return [along(n_dof, place.weights)]
        if place.node is not None:
            return [self._of_node(place)]
        if place.row is not None:
            return list(np.atleast_2d(self._stored(place.row)))
        if place.place is not None:
            if place.place not in self.places:
                raise ModelDefinitionError(
                    f'place = "{place.place}" is not in the case{_describe_known(place.place, [*self.places])}'
                )
            return [self.places[place.place]]
        return self._at_stations(place)

    def row(self, place: PlaceTable) -> Row:
        """Return the mean row over the stations of a place, for sensors and loads."""
        return np.asarray(np.mean(self.rows(place), axis=0))

    def all_rows(self, places: Sequence[PlaceTable]) -> Float[NDArray[np.float64], "n r"]:
        """Return the rows of all stations of several places, one after the other."""
        return np.array([row for place in places for row in self.rows(place)])

    def _at_stations(self, place: PlaceTable) -> list[Row]:
        rom = self.matrices.rom
        assert place.at is not None
        if rom is None:
            raise JointError(
                f'at = "{place.at}" names a boundary of a reduced model, but the structure is plain matrices: give '
                "dof or weights"
            )
        result = _make_station_rows(place, rom, place.at)
        if place.other_at is not None:
            against = _make_station_rows(place, rom, place.other_at)
            if len(against) != len(result):
                raise JointError(
                    f'at = "{place.at}" has {len(result)} stations but other_at = "{place.other_at}" {len(against)}: '
                    "name two sets with the same number of stations, facing each other"
                )
            order = self._partners(rom, place, len(result))
            result = [row - against[other] for row, other in zip(result, order, strict=True)]
        if place.station is None:
            return result
        if place.station >= len(result):
            raise JointError(
                f'station = {place.station} does not exist: boundary set "{place.at}" has stations 0 to '
                f"{len(result) - 1}"
            )
        return [result[place.station]]

    def _partners(self, rom: ReducedModel, place: PlaceTable, n_station: int) -> list[int]:
        """Find the station of the other set that faces each station: sets of a mesh have their nodes in any order.

        The pairs have the smallest sum of squared distances; without coordinates they follow the order of the sets.
        """
        from scipy.optimize import linear_sum_assignment
        from scipy.spatial.distance import cdist

        axis = int(np.flatnonzero(_make_unit_vector(place))[0])
        here, there = (
            [self.dofs[int(row)].coordinates for row in rom.rows(str(name), axis)] if self.dofs else []
            for name in (place.at, place.other_at)
        )
        order = np.arange(n_station)
        if self.dofs and not any(item is None for item in (*here, *there)):
            squared = cdist(np.array(here), np.array(there), "sqeuclidean")
            least = linear_sum_assignment(squared)[1]
            if squared[order, least].sum() < (1 - ROUNDING) * squared[order, order].sum():
                order = least
        return [int(item) for item in order]

    def _of_node(self, place: PlaceTable) -> Row:
        moving = [(n, dof) for n, dof in enumerate(self.dofs) if dof.direction != "modal"]
        moving = [(n, dof) for n, dof in moving if place.body in {None, dof.body}]
        same = [(number, dof) for number, dof in moving if dof.node == place.node]
        result = [number for number, dof in same if dof.direction == place.direction]
        where = f"node = {place.node}" if place.body is None else f'node = {place.node} of body = "{place.body}"'
        if not same:
            nodes = sorted({dof.node for _, dof in moving})
            there = f"nodes {nodes[0]} to {nodes[-1]}" if nodes else "none"
            bodies = ", ".join(sorted({f'"{dof.body}"' for dof in self.dofs if dof.direction != "modal"}))
            raise ModelDefinitionError(
                f"{where} is not a node of the structure: it has {there}; bodies: {bodies or 'none'}"
            )
        if not result:
            has = ", ".join(dof.direction for _, dof in same)
            raise ModelDefinitionError(f'direction = "{place.direction}" does not exist at {where}: it has {has}')
        if len(result) > 1:
            raise ModelDefinitionError(
                f"{where} stands for degrees of freedom {result[0]} and {result[1]}: give the body as well"
            )
        row = np.zeros(self.matrices.n_dof)
        row[result[0]] = 1.0
        return row

    def _stored(self, name: str) -> NDArray[np.float64]:
        if name not in self.stored:
            raise ModelDefinitionError(
                f'row = "{name}" is not stored with the structure{_describe_known(name, [*self.stored])}'
            )
        return self.stored[name]


def _describe_known(name: str, known: Sequence[str]) -> str:
    hint = did_you_mean(name, known)
    if hint or not known:
        return hint or ": there are none"
    more = ", ..." if len(known) > MOST_LISTED else ""
    return f": there are {', '.join(known[:MOST_LISTED])}{more}"


def _make_unit_vector(place: PlaceTable) -> Float[NDArray[np.float64], "3"]:
    """Return the unit vector of a place's direction at its stations."""
    assert place.direction is not None
    components = np.array(AXES[place.direction] if isinstance(place.direction, str) else place.direction)
    return np.asarray(components / np.linalg.norm(components))


def _make_station_rows(place: PlaceTable, rom: ReducedModel, name: str) -> list[Row]:
    unit = _make_unit_vector(place)
    axes = [axis for axis in range(3) if unit[axis]]
    columns = [rom.rows(name, axis) for axis in axes]
    if len({len(column) for column in columns}) != 1:
        raise JointError(
            f'boundary set "{name}" has its directions at {" and ".join(str(len(column)) for column in columns)} '
            "nodes: give a direction along one axis"
        )
    return [
        along(rom.n_dof, {int(column[station]): unit[axis] for axis, column in zip(axes, columns, strict=True)})
        for station in range(len(columns[0]))
    ]
