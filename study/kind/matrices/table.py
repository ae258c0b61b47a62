"""``[structure]`` with ``kind = "matrices"``: files, supports, retained degrees of freedom."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from casefile.table import CaseModel
from casefile.validation import require_different
from fe.file.dof_table import DIRECTIONS, LARGEST_LABEL, N_TRANSLATION
from fe.file.imported_matrices import Units
from fe.file.matrix_file import MatrixSource
from study.case.joint_table import Name
from study.case.tables import StructureTable
from study.kind.blade.table import InteriorTable, ReducedDampingTable

FileName = Annotated[str, Field(min_length=1, examples=["stiffness.mtx"])]
DirectionName = Literal["x", "y", "z", "rotx", "roty", "rotz"]
UNITS = {"m, kg, s": Units.SI, "mm, tonne, s": Units.MILLIMETRE}


Nodes = Annotated[
    tuple[Annotated[int, Field(ge=0, le=LARGEST_LABEL, strict=True)], ...],
    AfterValidator(require_different),
    Field(min_length=1, examples=[[1, 2, 3]]),
]
Directions = Annotated[
    tuple[DirectionName, ...], AfterValidator(require_different), Field(min_length=1, examples=[["x", "y", "z"]])
]


class FilesTable(CaseModel):
    """Files of the matrices, relative to the case file, and of the degree of freedom of each row."""

    mass: FileName
    stiffness: FileName
    damping: FileName | None = None
    mass_name: str = ""
    stiffness_name: str = ""
    damping_name: str = ""
    dofs: FileName | None = None
    units: Literal["m, kg, s", "mm, tonne, s"] = "m, kg, s"

    def matrix(self, name: str, folder: Path) -> MatrixSource:
        """Return file and name of the matrix "mass", "stiffness" or "damping"; `folder` is that of the case file."""
        return MatrixSource(file=folder / getattr(self, name), name=getattr(self, f"{name}_name"))


class SupportTable(CaseModel):
    """Fixed nodes; directions that a node does not have are ignored."""

    nodes: Nodes
    directions: Directions = DIRECTIONS  # type: ignore[assignment]

    @property
    def numbers(self) -> list[int]:
        """Indices of the directions."""
        return [DIRECTIONS.index(item) for item in self.directions]


class BoundaryTable(SupportTable):
    """Named nodes that the reduced model retains; their rotations are retained as "NAME rotation"."""

    name: Name
    directions: Directions = DIRECTIONS[:N_TRANSLATION]  # type: ignore[assignment]


class MatricesTable(StructureTable):
    """Matrices of another program, their supports, and their reduction."""

    kind: Literal["matrices"]
    files: FilesTable
    support: tuple[SupportTable, ...] = ()
    boundary: Annotated[tuple[BoundaryTable, ...], Field(min_length=1)]
    reduction: InteriorTable = InteriorTable()
    damping: ReducedDampingTable | None = None
