"""Where joints, loads and outputs of a case act: a row over the structure's degrees of freedom."""

from typing import Annotated, Literal, Self

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from pydantic import Field, model_validator

from casefile.table import CaseModel
from reduction.errors import JointError
from reduction.file.structure_file import StructureMatrices
from reduction.jointed_system import along, between
from reduction.rom import ReducedModel

Row = Float[NDArray[np.float64], " r"]
DofNumber = Annotated[int, Field(ge=0, strict=True, examples=[3])]
Direction = Literal["x", "y", "z"] | tuple[float, float, float]

AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


class PlaceTable(CaseModel):
    """One way of saying where: ``dof`` (with ``other``), ``weights``, or ``at`` with ``direction`` in a reduced model.

    Degrees of freedom are counted from 0. ``station`` picks one node of a boundary set, counted from 0; without it,
    contacts and joints are made at every station, and loads and outputs take the mean of all.
    """

    dof: DofNumber | None = None
    other: DofNumber | None = None
    weights: Annotated[dict[Annotated[int, Field(ge=0)], float] | None, Field(examples=[{"3": 1.0, "5": -1.0}])] = None
    at: str | None = None
    other_at: str | None = None
    station: Annotated[int, Field(ge=0, strict=True)] | None = None
    direction: Annotated[Direction | None, Field(examples=["x"])] = None

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        ways = [name for name in ("dof", "weights", "at") if getattr(self, name) is not None]
        if len(ways) != 1:
            found = f"{' and '.join(ways)} are given" if ways else "says nowhere where"
            raise ValueError(f"{found}: give one of dof, weights, and at with direction")
        if self.other is not None and self.dof is None:
            raise ValueError(f"other = {self.other} goes with dof alone: write dof = ..., or all as weights")
        if self.at is None and (self.other_at, self.station, self.direction) != (None, None, None):
            raise ValueError(
                "other_at, station and direction go with at, the name of a boundary set of a reduced model"
            )
        if self.at is not None and self.direction is None:
            raise ValueError(f'at = "{self.at}" needs a direction, e.g. direction = "x" or [0.6, 0.0, 0.8]')
        if isinstance(self.direction, tuple) and not any(self.direction):
            raise ValueError("direction = [0, 0, 0] points nowhere: give three components, e.g. [0.6, 0.0, 0.8]")
        if self.weights is not None and not any(self.weights.values()):
            raise ValueError("its weights are empty or all zero: give at least one, e.g. weights = {3 = 1.0, 5 = -1.0}")
        return self


def rows(place: PlaceTable, structure: StructureMatrices) -> list[Row]:
    """Row of each station that a place stands for; one row for numbered degrees of freedom.

    Parameters
    ----------
    place
        As in the case.
    structure
        What the file holds; its reduced model knows the names.

    Raises
    ------
    JointError, RomError
        A degree of freedom, a boundary set, a direction or a station that the structure does not have.
    """
    n_dof = structure.n_dof
    if place.dof is not None:
        return [between(n_dof, place.dof, place.other)]
    if place.weights is not None:
        return [along(n_dof, place.weights)]
    assert place.at is not None
    if structure.rom is None:
        raise JointError(
            f'at = "{place.at}" names a boundary of a reduced model, but the file holds plain matrices: give dof or '
            "weights"
        )
    found = _station_rows(place, structure.rom, place.at)
    if place.other_at is not None:
        against = _station_rows(place, structure.rom, place.other_at)
        if len(against) != len(found):
            raise JointError(
                f'at = "{place.at}" has {len(found)} stations but other_at = "{place.other_at}" {len(against)}: name '
                "two sets that face each other, station by station"
            )
        found = [row - other for row, other in zip(found, against, strict=True)]
    if place.station is None:
        return found
    if place.station >= len(found):
        raise JointError(
            f'station = {place.station} does not exist: boundary set "{place.at}" has stations 0 to {len(found) - 1}'
        )
    return [found[place.station]]


def mean_row(place: PlaceTable, structure: StructureMatrices) -> Row:
    """Mean over the stations of a place: the displacement that an output shows, and how a load is shared.

    Raises
    ------
    JointError, RomError
        As `rows`.
    """
    return np.asarray(np.mean(rows(place, structure), axis=0))


def _station_rows(place: PlaceTable, rom: ReducedModel, name: str) -> list[Row]:
    assert place.direction is not None
    components = AXES[place.direction] if isinstance(place.direction, str) else place.direction
    unit = np.array(components) / np.linalg.norm(components)
    axes = [axis for axis in range(3) if unit[axis]]
    columns = [rom.rows(name, axis) for axis in axes]
    if len({len(column) for column in columns}) != 1:
        raise JointError(
            f'boundary set "{name}" keeps its directions at {" and ".join(str(len(column)) for column in columns)} '
            "nodes: give a direction along one axis"
        )
    return [
        along(rom.n_dof, {int(column[station]): unit[axis] for axis, column in zip(axes, columns, strict=True)})
        for station in range(len(columns[0]))
    ]
