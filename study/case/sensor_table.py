"""The tables ``[[sensor]]`` of a case: sensors of motion, of forces of contact lines, and load cells."""

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Tag

from casefile.quantity import Ratio
from casefile.table import CaseModel
from study.case.joint_table import Name
from study.case.place import PlaceTable


class MotionSensorTable(PlaceTable):
    """A sensor of the motion of a place."""

    name: Name
    quantity: Literal["displacement", "velocity", "acceleration"] = "displacement"
    gain: Ratio = 1.0
    relative: bool = False


class LineSensorTable(CaseModel):
    """A sensor of the force of a contact line."""

    name: Name
    line: str
    component: Literal["tangential", "normal"]
    gain: Ratio = 1.0


class LoadCellTable(CaseModel):
    """A sensor that reads a load cell of the structure."""

    name: Name
    cell: str
    gain: Ratio = 1.0


def _read_by(sensor: Any) -> str:
    """Find the type of a sensor: the key ``line`` is for contact forces, ``cell`` for load cells."""
    given = sensor if isinstance(sensor, dict) else {}
    if isinstance(sensor, LineSensorTable) or "line" in given:
        return "force"
    return "cell" if isinstance(sensor, LoadCellTable) or "cell" in given else "motion"


SensorTable = Annotated[
    Annotated[MotionSensorTable, Tag("motion")]
    | Annotated[LineSensorTable, Tag("force")]
    | Annotated[LoadCellTable, Tag("cell")],
    Discriminator(_read_by),
]
