"""From a table ``[[joint]]`` of a case to joints, one for each station of its places."""

from collections.abc import Callable

import numpy as np

from casefile.table import located
from reduction.errors import JointError
from reduction.jointed_system import (
    CubicSpring,
    ElasticStop,
    Friction,
    FrictionContact,
    JenkinsElement,
    Joint,
    QuadraticDamper,
)
from study.case.joint_table import CubicTable, FrictionTable, JenkinsTable, QuadraticDamperTable, StopTable
from study.case.place import PlaceFinder, Row
from study.case.tables import Case, StructureTable


def joints_of_table(case: Case[StructureTable], number: int, finder: PlaceFinder) -> list[Joint]:
    """Joints of one table.

    Parameters
    ----------
    case
        Names file and line of a mistake.
    number
        Of the table among ``[[joint]]``.
    finder
        What its places are looked up in.
    """
    table = case.joint[number]
    if isinstance(table, FrictionTable):
        return _friction_contacts(case, number, table, finder)
    directions = finder.rows(table)
    make: Callable[[str, Row], Joint]
    if isinstance(table, JenkinsTable):
        stiffness, limit = table.tangential_stiffness, table.limit_force

        def make(name: str, row: Row) -> Joint:
            return JenkinsElement(name=name, direction=row, tangential_stiffness=stiffness, limit_force=limit)

    elif isinstance(table, CubicTable):
        cubic = table.stiffness

        def make(name: str, row: Row) -> Joint:
            return CubicSpring(name=name, direction=row, stiffness=cubic)

    elif isinstance(table, StopTable):
        stop, gap = table.stiffness, table.gap

        def make(name: str, row: Row) -> Joint:
            return ElasticStop(name=name, direction=row, stiffness=stop, gap=gap)

    else:
        assert isinstance(table, QuadraticDamperTable)
        drag = table.damping

        def make(name: str, row: Row) -> Joint:
            return QuadraticDamper(name=name, direction=row, damping=drag)

    names = _station_names(table.name, len(directions))
    return [make(name, row) for name, row in zip(names, directions, strict=True)]


def _friction_contacts(
    case: Case[StructureTable], number: int, table: FrictionTable, finder: PlaceFinder
) -> list[Joint]:
    places = {"tangent": table.tangent, "second_tangent": table.second_tangent, "normal": table.normal}
    labels, found = [], []
    for label, place in places.items():
        if place is not None:
            with located(case, "joint", number, label):
                labels.append(label)
                found.append(finder.rows(place))
    counts = {len(each) for each in found}
    if len(counts) > 1:
        listed = ", ".join(f"{label} {len(each)}" for label, each in zip(labels, found, strict=True))
        raise JointError(f"its places have different numbers of stations ({listed}): a contact needs one of each")
    names = _station_names(table.name, counts.pop())
    return [
        FrictionContact(
            name=name,
            normal=station[-1],
            tangents=np.array(station[:-1]),
            normal_stiffness=table.normal_stiffness,
            tangential_stiffness=table.tangential_stiffness,
            friction_coefficient=table.friction_coefficient,
            preload=table.preload,
            gap=table.gap,
            friction=Friction(table.friction),
        )
        for name, station in zip(names, zip(*found, strict=True), strict=True)
    ]


def _station_names(name: str, count: int) -> list[str]:
    return [name] if count == 1 else [f"{name} {station}" for station in range(count)]
