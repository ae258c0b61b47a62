"""``[structure]`` with ``kind = "part"``: a user's part from a CAD file or a mesh file.

The table defines the supports of the part, the points, lines and sets that are retained, and the reduction.
"""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from casefile.quantity import LENGTH, Area, Length
from casefile.table import CaseModel
from casefile.validation import require_different
from fe.file.dof_table import DIRECTIONS, N_TRANSLATION
from geometry.face_selector import FaceSelector
from geometry.interface import N_STATION
from study.case.joint_table import Name
from study.case.tables import StructureTable
from study.kind.blade.table import InteriorTable, MaterialTable, ReducedDampingTable

FileName = Annotated[str, Field(min_length=1, examples=["part.step"])]
Place = Annotated[tuple[Length, Length, Length], Field(examples=[["10 mm", "0 mm", "5 mm"]])]
TRANSLATIONS = DIRECTIONS[:N_TRANSLATION]
#: Suffixes of CAD files; all other files are meshes.
STEP_SUFFIXES = (".step", ".stp")


def _unit(value: object) -> float:
    if not isinstance(value, str):
        raise ValueError('is the unit of the coordinates in the file, such as "mm"')
    return LENGTH.read(f"1 {value}")


Names = Annotated[tuple[Name, ...], AfterValidator(require_different), Field(min_length=1, examples=[["clamp"]])]
Directions = Annotated[
    tuple[Literal["x", "y", "z"], ...],
    AfterValidator(require_different),
    Field(min_length=1, examples=[["x", "y", "z"]]),
]
LengthUnit = Annotated[float, BeforeValidator(_unit), Field(gt=0, examples=["mm"])]
Stations = Annotated[int, Field(ge=2, le=1000, strict=True)]


class FaceTable(CaseModel):
    """A name for the faces of a STEP file that fit all given keys; tables of the same name are combined."""

    name: Name
    step_name: Name | None = None
    colour: str | None = None
    at: Place | None = None
    normal: tuple[float, float, float] | None = None
    area: Annotated[tuple[Area, Area] | None, Field(examples=[["70 mm^2", "71 mm^2"]])] = None

    def selector(self) -> FaceSelector:
        """Make the selector of the faces: by `name`, if no other key is given."""
        given = {"colour": self.colour, "at": self.at, "normal": self.normal, "area": self.area}
        by_name = self.step_name
        if by_name is None and not any(value is not None for value in given.values()):
            by_name = self.name
        return FaceSelector(name=by_name, colour=self.colour, at=self.at, normal=self.normal, area=self.area)


class PartSupportTable(CaseModel):
    """Fixed faces, or fixed sets of a mesh file."""

    on: Names
    directions: Directions = ("x", "y", "z")

    @property
    def numbers(self) -> tuple[int, ...]:
        """Indices of the directions."""
        return tuple(TRANSLATIONS.index(item) for item in self.directions)


class PointTable(CaseModel):
    """A retained point of the surface, independent of the positions of nodes."""

    name: Name
    at: Place
    on: Name | None = None
    directions: Directions = ("x", "y", "z")


class StationLineTable(CaseModel):
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
            raise ValueError(
                "has an edge, which gives its position: remove on and to (from is the end where it begins)"
            )
        if self.edge is not None and self.edge[0] == self.edge[1]:
            raise ValueError(f'edge names "{self.edge[0]}" twice: name the two faces that meet there')
        return self


class WholeSetTable(CaseModel):
    """A retained face, or set of a mesh file, with all its nodes."""

    name: Name
    on: Name
    directions: Directions = ("x", "y", "z")


class TetMeshTable(CaseModel):
    """Sizes of the tetrahedra, in general and at named faces."""

    element: Literal["tet10"] = "tet10"
    size: Length
    near: dict[Name, Length] = Field(default_factory=dict)


class PartTable(StructureTable):
    """A part: a STEP file with the size of elements, or a mesh file with the unit of length."""

    kind: Literal["part"]
    file: FileName
    material: MaterialTable | None = None
    support: tuple[PartSupportTable, ...] = ()
    point: tuple[PointTable, ...] = ()
    line: tuple[StationLineTable, ...] = ()
    boundary: tuple[WholeSetTable, ...] = ()
    reduction: InteriorTable = InteriorTable()
    damping: ReducedDampingTable | None = None
    face: tuple[FaceTable, ...] = ()
    mesh: TetMeshTable | None = None
    length_unit: LengthUnit | None = None

    @property
    def is_step(self) -> bool:
        """Whether the file is a CAD file."""
        return Path(self.file).suffix.lower() in STEP_SUFFIXES

    @model_validator(mode="after")
    def _one_form(self) -> Self:
        if self.is_step and self.material is None:
            raise ValueError("table [structure.material] is missing: add it, with young, poisson and density")
        if self.is_step and self.mesh is None:
            raise ValueError(
                f'file = "{self.file}" has to be meshed: add [structure.mesh] with a size, e.g. size = "2 mm"'
            )
        if self.is_step and self.length_unit is not None:
            raise ValueError(
                f'length_unit is for mesh files; file = "{self.file}" contains its unit: remove length_unit'
            )
        if not self.is_step and (self.mesh is not None or self.face):
            table = "[structure.mesh]" if self.mesh is not None else "[[structure.face]]"
            raise ValueError(
                f'{table} is for STEP files, which end in {", ".join(STEP_SUFFIXES)}; file = "{self.file}" is read as '
                f"a mesh: remove {table}, or name a STEP file"
            )
        if not self.is_step and self.length_unit is None:
            raise ValueError(
                f'file = "{self.file}" contains coordinates without a unit: add length_unit, e.g. length_unit = "mm"'
            )
        return self
