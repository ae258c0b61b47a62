"""What was understood of measured tables, as rows that people read."""

from collections.abc import Sequence

from study.campaign.column_role import Part, Role
from study.campaign.draft import Note
from study.campaign.table_kind import JudgedTable, Kind


def list_notes(tables: Sequence[JudgedTable]) -> list[Note]:
    """Rows of all tables; tables that are alike stand together.

    Parameters
    ----------
    tables
        Judged tables in the order of the files.
    """
    groups: dict[tuple[object, ...], list[JudgedTable]] = {}
    for judged in tables:
        groups.setdefault((judged.table.file.path.name, judged.kind, *_described(judged)), []).append(judged)
    return [note for members in groups.values() for note in _notes(members)]


def _notes(members: Sequence[JudgedTable]) -> list[Note]:
    """Kind of some tables that are alike, then their columns."""
    judged = members[0]
    label = judged.table.path or f"{len(judged.table.columns)} columns"
    label += f" and {len(members) - 1} more" if len(members) > 1 else ""
    head = Note(
        file=judged.table.file.path.name, columns=label, role=judged.kind.value, unit="", evidence=judged.evidence
    )
    if judged.kind is Kind.NOT_USED:
        return [head]
    rows = _described(judged)
    return [head, *(Note(file="", columns=name, role=role, unit=unit, evidence=why) for name, role, unit, why in rows)]


def _described(judged: JudgedTable) -> list[tuple[str, str, str, str]]:
    """Name, role, unit and evidence of each column."""
    settings = {column.name for column in judged.settings}
    rows = []
    for column in judged.table.columns:
        guess = judged.columns[column.name]
        role = guess.role.value
        if guess.role in {Role.RESPONSE, Role.FORCE}:
            kind = guess.quantity if guess.quantity != role else ""
            details = [word for word in (kind, "" if guess.part is Part.VALUE else guess.part.value) if word]
            role += f" ({', '.join(details)})" if details else ""
        evidence = guess.evidence
        if column.name in settings:
            role, evidence = "setting", "each of its values is a series of its own"
        rows.append((judged.table.short_name(column), role, guess.unit, evidence))
    return rows
