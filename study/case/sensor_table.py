"""The tables ``[[sensor]]`` of a case: motions of places, forces of contact lines, and load cells."""

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Tag

from casefile.quantity import Ratio
from casefile.table import CaseModel
from study.case.joint_table import Name
from study.case.place import PlaceTable


class MotionSensorTable(PlaceTable):
    """What reads the motion of a place."""

    name: Name
    quantity: Literal["displacement", "velocity", "acceleration"] = "displacement"
    gain: Ratio = 1.0
    relative: bool = False


class LineSensorTable(CaseModel):
    """What reads the force of a line."""

    name: Name
    line: str
    component: Literal["tangential", "normal"]
    gain: Ratio = 1.0


class LoadCellTable(CaseModel):
    """What reads a load cell that the structure has."""

    name: Name
    cell: str
    gain: Ratio = 1.0


def _read_by(sensor: Any) -> str:
    """What a sensor reads: the key ``line`` is that of contact forces, ``cell`` that of load cells."""
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
