"""A case kind from outside: a mass on springs beside a wall, two numbers in place of a file of matrices."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from casefile.quantity import Mass, Stiffness
from correlation.model import Dof, Sensor
from reduction.file.structure_file import StructureMatrices
from study.case.structure import Structure
from study.case.tables import StructureTable
from study.kind.registry import CASE_KINDS, CaseKind, OpenCase
from study.run_context import RunContext

#: Damping ratio of the mass on its springs [-].
RATIO = 0.005


class MassOnWallTable(StructureTable):
    kind: Literal["mass_on_wall"]
    mass: Annotated[Mass, Field(gt=0, examples=["1 kg"])]
    stiffness: Annotated[Stiffness, Field(gt=0, examples=["1 N/um"])]


def structure(opened: OpenCase, run: RunContext) -> Structure:
    """A mass that moves along the wall (x) and towards it (y), on a spring each way."""
    table = opened.case.structure
    mass, stiffness = table.mass * np.eye(2), table.stiffness * np.eye(2)
    along, across = np.eye(2)
    return Structure(
        matrices=StructureMatrices(
            mass=mass, stiffness=stiffness, damping=2 * RATIO * np.sqrt(table.mass * table.stiffness) * np.eye(2)
        ),
        dofs=tuple(Dof(body="mass", node=1, direction=item, coordinates=np.zeros(3)) for item in "xy"),
        places={"along": along, "across": across},
        sensors=(Sensor(name="along", row=along),),
    )


CASE_KINDS.register(
    CaseKind(
        name="mass_on_wall",
        summary="a mass on a wall",
        table=MassOnWallTable,
        structure=structure,
        reduce="it has two degrees of freedom, so that nothing is left to reduce",
        modes="its modes are the motions along its two springs",
    )
)
