"""Where lines, sensors and loads of a test case act: places of ``stickslip solve``, and three more ways to say them.

``body``, ``node`` and ``direction`` name a degree of freedom of the table, ``row`` names rows that the file of the
structure stores, ``place`` a place of the case.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Literal, Self

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from pydantic import Field, ValidationError, model_validator

from casefile.table import CaseModel
from casefile.validation import did_you_mean
from correlation.errors import ModelDefinitionError
from correlation.model import Dof
from reduction.file.structure_file import StructureMatrices
from study.case.old_place import DofNumber, PlaceTable, Row, rows

Direction = Literal["x", "y", "z", "rx", "ry", "rz"] | tuple[float, float, float]
WAYS = ("dof", "weights", "at", "node", "row", "place")
#: Names of many listed in a message.
MOST_LISTED = 12


class TestPlaceTable(CaseModel):
    """One way of saying where, and which way."""

    dof: DofNumber | None = None
    other: DofNumber | None = None
    weights: Annotated[dict[Annotated[int, Field(ge=0)], float] | None, Field(examples=[{"3": 1.0, "5": -1.0}])] = None
    at: str | None = None
    other_at: str | None = None
    station: Annotated[int, Field(ge=0, strict=True)] | None = None
    body: str | None = None
    node: Annotated[int, Field(strict=True)] | None = None
    direction: Annotated[Direction | None, Field(examples=["z"])] = None
    row: Annotated[str | None, Field(examples=["tip"])] = None
    place: str | None = None

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        ways = [name for name in WAYS if getattr(self, name) is not None]
        if len(ways) != 1:
            found = f"{' and '.join(ways)} are given" if ways else "says nowhere where"
            raise ValueError(f"{found}: give one of {', '.join(WAYS)}")
        if self.body is not None and self.node is None:
            raise ValueError(f'body = "{self.body}" goes with node and direction: give them')
        if self.node is not None:
            if not isinstance(self.direction, str):
                raise ValueError(f'node = {self.node} needs one of its directions, e.g. direction = "z"')
            if (self.other, self.other_at, self.station) != (None, None, None):
                raise ValueError("other, other_at and station do not go with node: write the row as weights")
        elif self.row is not None or self.place is not None:
            if (self.other, self.other_at, self.station, self.direction) != (None, None, None, None):
                raise ValueError("a row or a place is complete: remove other, other_at, station and direction")
        else:
            if isinstance(self.direction, str) and self.direction not in {"x", "y", "z"}:
                raise ValueError(f'direction = "{self.direction}" goes with node alone: give "x", "y", "z" or a vector')
            try:
                self.solve_place()
            except ValidationError as error:
                raise ValueError(error.errors()[0]["msg"].removeprefix("Value error, ")) from None
        return self

    def solve_place(self) -> PlaceTable:
        """The same as a place of ``stickslip solve``, which checks it."""
        given = {name: getattr(self, name) for name in PlaceTable.model_fields if getattr(self, name) is not None}
        return PlaceTable(**given)


@dataclass(frozen=True, kw_only=True, eq=False)
class Whereabouts:
    """What the rows of a case are looked up in.

    Parameters
    ----------
    structure
        Matrices, and the reduced model if they come from one.
    dofs
        What each degree of freedom is, r of them.
    stored
        Rows that the file of the structure holds, shape (r,) or (n, r), by name.
    places
        Of the case, by name.
    """

    structure: StructureMatrices
    dofs: Sequence[Dof]
    stored: Mapping[str, NDArray[np.float64]]
    places: dict[str, Row] = field(default_factory=dict)

    def rows(self, place: TestPlaceTable) -> list[Row]:
        """Row of each station that a place stands for.

        Raises
        ------
        ModelDefinitionError, JointError, RomError
            A name, number or direction that the structure does not have.
        """
        if place.node is not None:
            return [self._of_node(place)]
        if place.row is not None:
            return list(np.atleast_2d(self._stored(place.row)))
        if place.place is not None:
            if place.place not in self.places:
                raise ModelDefinitionError(
                    f'place = "{place.place}" is none of the case{_known(place.place, [*self.places])}'
                )
            return [self.places[place.place]]
        return rows(place.solve_place(), self.structure)

    def row(self, place: TestPlaceTable) -> Row:
        """Mean over the stations of a place."""
        return np.asarray(np.mean(self.rows(place), axis=0))

    def all_rows(self, places: Sequence[TestPlaceTable]) -> Float[NDArray[np.float64], "n r"]:
        """Rows of all stations of several places, one after the other."""
        return np.array([row for place in places for row in self.rows(place)])

    def _of_node(self, place: TestPlaceTable) -> Row:
        same = [
            number
            for number, dof in enumerate(self.dofs)
            if dof.node == place.node and place.body in {None, dof.body} and dof.direction != "modal"
        ]
        found = [number for number in same if self.dofs[number].direction == place.direction]
        where = f"node = {place.node}" if place.body is None else f'body = "{place.body}", node = {place.node}'
        if not same:
            nodes = sorted(
                {dof.node for dof in self.dofs if dof.direction != "modal" and place.body in {None, dof.body}}
            )
            listed = f"nodes {nodes[0]} to {nodes[-1]}" if nodes else "none"
            bodies = ", ".join(sorted({f'"{dof.body}"' for dof in self.dofs if dof.direction != "modal"}))
            raise ModelDefinitionError(
                f"{where} is no node of the structure: it has {listed}; bodies: {bodies or 'none'}"
            )
        if not found:
            has = ", ".join(self.dofs[number].direction for number in same)
            raise ModelDefinitionError(f'direction = "{place.direction}" is not kept at {where}: it has {has}')
        if len(found) > 1:
            raise ModelDefinitionError(
                f"{where} stands for degrees of freedom {found[0]} and {found[1]}: give the body, too"
            )
        row = np.zeros(self.structure.n_dof)
        row[found[0]] = 1.0
        return row

    def _stored(self, name: str) -> NDArray[np.float64]:
        if name not in self.stored:
            raise ModelDefinitionError(
                f'row = "{name}" is not in the file of the structure{_known(name, [*self.stored])}'
            )
        return self.stored[name]


def _known(name: str, known: Sequence[str]) -> str:
    hint = did_you_mean(name, known)
    if hint or not known:
        return hint or ": there are none"
    more = ", ..." if len(known) > MOST_LISTED else ""
    return f": there are {', '.join(known[:MOST_LISTED])}{more}"
