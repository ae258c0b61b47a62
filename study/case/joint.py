"""From a table ``[[joint]]`` of a case to joints, one for each station of its places."""

from casefile.table import located
from reduction.errors import JointError
from reduction.joint.law import LAWS, Joint
from study.case.joint_table import DIRECTION
from study.case.place import PlaceFinder
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

    Raises
    ------
    JointError
        Places of different numbers of stations, or numbers that the law refuses.
    """
    table = case.joint[number]
    law = LAWS[table.kind]
    rows = {}
    for label in law.places:
        place = table if label == DIRECTION else getattr(table, label)
        if place is not None:
            with located(case, "joint", number, *(() if label == DIRECTION else (label,))):
                rows[label] = finder.rows(place)
    counts = {len(each) for each in rows.values()}
    if len(counts) > 1:
        listed = ", ".join(f"{label} {len(each)}" for label, each in rows.items())
        raise JointError(f"its places have different numbers of stations ({listed}): a contact needs one of each")
    keys = [*(each.name for each in law.parameters), *(each.name for each in law.options)]
    values = {key: getattr(table, key) for key in keys}
    count = counts.pop()
    names = [table.name] if count == 1 else [f"{table.name} {station}" for station in range(count)]
    return [
        law.build(name, {label: each[station] for label, each in rows.items()}, values)
        for station, name in enumerate(names)
    ]
