"""The tables ``[[sensor]]`` of a case: motions of places, and forces of contact lines."""

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


def _read_by(sensor: Any) -> str:
    """What a sensor reads: the key ``line`` is that of forces."""
    return (
        "force" if isinstance(sensor, LineSensorTable) or (isinstance(sensor, dict) and "line" in sensor) else "motion"
    )


SensorTable = Annotated[
    Annotated[MotionSensorTable, Tag("motion")] | Annotated[LineSensorTable, Tag("force")], Discriminator(_read_by)
]
