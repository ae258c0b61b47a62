"""The case files of a user's own part: ``kind = "step"``, a CAD file, or ``kind = "mesh"``, a mesh file.

Both say what holds the part, which points, lines and sets stay physical, and how far it is reduced.
"""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from casefile.head import case_head, other_case
from casefile.quantity import LENGTH, Area, Length
from casefile.table import CaseModel
from fe.file.dof_table import DIRECTIONS, N_TRANSLATION
from geometry.face_selector import FaceSelector
from geometry.interface import N_STATION
from study.case.joint_table import Name
from study.kind.blade.table import DampingTable, MaterialTable

FileName = Annotated[str, Field(min_length=1, examples=["part.step"])]
Place = Annotated[tuple[Length, Length, Length], Field(examples=[["10 mm", "0 mm", "5 mm"]])]
TRANSLATIONS = DIRECTIONS[:N_TRANSLATION]


def _different(values: tuple[str, ...]) -> tuple[str, ...]:
    for place, value in enumerate(values):
        if value in values[:place]:
            raise ValueError(f'"{value}" stands there twice: remove one')
    return values


def _unit(value: object) -> float:
    if not isinstance(value, str):
        raise ValueError('is the unit of the coordinates in the file, such as "mm"')
    return LENGTH.read(f"1 {value}")


Names = Annotated[tuple[Name, ...], AfterValidator(_different), Field(min_length=1, examples=[["clamp"]])]
Directions = Annotated[
    tuple[Literal["x", "y", "z"], ...],
    AfterValidator(_different),
    Field(min_length=1, examples=[["x", "y", "z"]]),
]
LengthUnit = Annotated[float, BeforeValidator(_unit), Field(gt=0, examples=["mm"])]
Stations = Annotated[int, Field(ge=2, le=1000, strict=True)]


class FaceTable(CaseModel):
    """A name for faces of a STEP file: those that fit all that is given; tables of one name are taken together."""

    name: Name
    step_name: Name | None = None
    colour: str | None = None
    at: Place | None = None
    normal: tuple[float, float, float] | None = None
    area: Annotated[tuple[Area, Area] | None, Field(examples=[["70 mm^2", "71 mm^2"]])] = None

    def selector(self) -> FaceSelector:
        """What it looks for; the name itself, if nothing else is said."""
        given = {"colour": self.colour, "at": self.at, "normal": self.normal, "area": self.area}
        by_name = self.step_name
        if by_name is None and not any(value is not None for value in given.values()):
            by_name = self.name
        return FaceSelector(name=by_name, colour=self.colour, at=self.at, normal=self.normal, area=self.area)


class PartSupportTable(CaseModel):
    """Faces, or sets of a mesh file, that are held."""

    on: Names
    directions: Directions = ("x", "y", "z")

    @property
    def numbers(self) -> tuple[int, ...]:
        """Directions by number."""
        return tuple(TRANSLATIONS.index(each) for each in self.directions)


class PointTable(CaseModel):
    """A point of the surface that stays physical, wherever the nodes are."""

    name: Name
    at: Place
    on: Name | None = None
    directions: Directions = ("x", "y", "z")


class LineTable(CaseModel):
    """Contact stations: on the straight line between two points of a face, or along the edge of two faces."""

    name: Name
    on: Name | None = None
    start: Annotated[Place | None, Field(alias="from")] = None
    end: Annotated[Place | None, Field(alias="to")] = None
    edge: tuple[Name, Name] | None = None
    stations: Stations = N_STATION

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        straight = (self.on, self.start, self.end)
        if self.edge is None and None in straight:
            raise ValueError("give a face with two of its points (on, from and to), or the edge of two faces (edge)")
        if self.edge is not None and (self.on is not None or self.end is not None):
            raise ValueError("has an edge, which says where it lies: remove on and to (from tells where it begins)")
        if self.edge is not None and self.edge[0] == self.edge[1]:
            raise ValueError(f'edge names "{self.edge[0]}" twice: name the two faces that meet there')
        return self


class WholeSetTable(CaseModel):
    """All nodes of a face, or of a set of a mesh file, that stay physical."""

    name: Name
    on: Name
    directions: Directions = ("x", "y", "z")


class PartReductionTable(CaseModel):
    """Craig-Bampton reduction."""

    modes: Annotated[int, Field(ge=0, le=2000, strict=True)] = 150


class PartTables(CaseModel):
    """What both kinds hold."""

    title: str = "Part"
    file: FileName
    material: MaterialTable
    support: tuple[PartSupportTable, ...] = ()
    point: tuple[PointTable, ...] = ()
    line: tuple[LineTable, ...] = ()
    boundary: tuple[WholeSetTable, ...] = ()
    reduction: PartReductionTable = PartReductionTable()
    damping: DampingTable | None = None


class TetMeshTable(CaseModel):
    """How large the tetrahedra are, and at named faces."""

    element: Literal["tet10"] = "tet10"
    size: Length
    near: dict[Name, Length] = Field(default_factory=dict)


class StepCase(PartTables):
    """A part as CAD file."""

    kind: Annotated[Literal["step"], Field(examples=["step"])]
    face: tuple[FaceTable, ...] = ()
    mesh: TetMeshTable


class MeshCase(PartTables):
    """A part as mesh file with named sets."""

    kind: Annotated[Literal["mesh"], Field(examples=["mesh"])]
    length_unit: LengthUnit


def part_kind(path: Path) -> type[StepCase] | type[MeshCase] | None:
    """Which case of a part a file is, by its kind or its file; None for all others, and for what cannot be read."""
    data = case_head(path)
    kind = data.get("kind")
    if kind == "mesh" or (kind != "step" and "length_unit" in data):
        return MeshCase
    return StepCase if kind == "step" or isinstance(data.get("file"), str) else None


def refuse_part(path: Path, remedy: str) -> None:
    """Refuse the case of a part, for commands that are not for parts; `remedy` is as in `other_case`."""
    if part_kind(path) is not None:
        raise other_case(path, "a part", remedy)
