"""Notes on the interpretation of measured tables, as rows of the printed table."""

from collections.abc import Sequence

from correlation.file.column import MeasuredFile
from correlation.file.format.uff import NOT_READ
from correlation.file.text_table.footer import describe_footer
from study.campaign.column_role import NO_VALUE, UNKNOWN_UNIT, ComplexPart, Role
from study.campaign.draft import Note
from study.campaign.table import FEWEST
from study.campaign.table_kind import JudgedTable, Kind, suggest_unit_remedy
from study.merge_sentences import NUMBER


def list_notes(tables: Sequence[JudgedTable]) -> list[Note]:
    """Notes on all tables; tables of any file that differ only in numbers of their evidence have common notes.

    Parameters
    ----------
    tables
        Judged tables in the order of the files.
    """
    groups: dict[tuple[object, ...], list[JudgedTable]] = {}
    for judged in tables:
        rows = [(name, role, unit, NUMBER.sub("#", why)) for name, role, unit, why in _describe_columns(judged)]
        why = NUMBER.sub("#", judged.evidence)
        groups.setdefault((judged.table.file.format, judged.kind, why, *rows), []).append(judged)
    return [note for members in groups.values() for note in _make_notes(members)]


def describe_unused_columns(judged: JudgedTable) -> list[str]:
    """Sentences on channels that cannot be used: not a motion, without values or without a known unit; and on a footer.

    Parameters
    ----------
    judged
        Table; for a table that is not used as a whole, only the sentence on the footer.
    """
    closing = describe_footer(judged.table.file.facts)
    sentences = [f"{judged.table.file.path.name}, {closing}"] if closing else []
    for column in judged.of_role(Role.FOREIGN, Role.OTHER) if judged.kind is not Kind.NOT_USED else []:
        guess = judged.columns[column.name]
        place = f'{judged.table.file.path.name}: "{column.name}" is not used'
        if guess.role is Role.FOREIGN or guess.evidence == NO_VALUE:
            sentences.append(f"{place}: {guess.evidence}")
        elif guess.evidence.startswith(UNKNOWN_UNIT):
            sentences.append(f"{place}: {guess.evidence}; {suggest_unit_remedy(judged)}")
        elif judged.kind is Kind.MODES:
            sentences.append(
                f"{place}: {guess.evidence}; [[mode]] has frequency, damping, their deviations and a shape"
            )
    return sentences


def describe_unused_file(file: MeasuredFile, tables: Sequence[JudgedTable]) -> str:
    """Reason why nothing of a file is used; empty if something is used.

    Parameters
    ----------
    file
        Measured file.
    tables
        Its tables.
    """
    name = file.path.name
    if tables:
        reasons = dict.fromkeys(judged.evidence for judged in tables if judged.kind is Kind.NOT_USED)
        return f"{name}: {'; '.join(reasons)}" if all(judged.kind is Kind.NOT_USED for judged in tables) else ""
    if not file.columns or file.shapes:
        return "" if file.shapes or file.nodes or NOT_READ in file.facts else f"{name}: it has no columns"
    rows = max(len(column.values) for column in file.columns)
    needed = f"a sweep or a time history needs {FEWEST} or more; give natural frequencies as [[mode]]"
    return f"{name}: it has {rows} {'row' if rows == 1 else 'rows'}, and {needed}"


def _make_notes(members: Sequence[JudgedTable]) -> list[Note]:
    """Notes on some similar tables: one on their kind, then one on each column."""
    judged = members[0]
    label = judged.table.path or f"{len(judged.table.columns)} columns"
    others, files = len(members) - 1, len({member.table.file.path.name for member in members})
    if others and files == len(members):
        label += f", and {others} more files"
    elif others:
        label += f" and {others} more" + (f" in {files} files" if files > 1 else "")
    head = Note(
        file=judged.table.file.path.name, columns=label, role=judged.kind.value, unit="", evidence=judged.evidence
    )
    if judged.kind is Kind.NOT_USED:
        return [head]
    rows = _describe_columns(judged)
    return [head, *(Note(file="", columns=name, role=role, unit=unit, evidence=why) for name, role, unit, why in rows)]


def _describe_columns(judged: JudgedTable) -> list[tuple[str, str, str, str]]:
    """Name, role, unit and evidence of each column."""
    settings = {column.name for column in judged.settings}
    rows = []
    for column in judged.table.columns:
        guess = judged.columns[column.name]
        role = guess.role.value
        if guess.role in {Role.RESPONSE, Role.FORCE}:
            kind = guess.quantity if guess.quantity != role else ""
            details = [word for word in (kind, "" if guess.part is ComplexPart.VALUE else guess.part.value) if word]
            role += f" ({', '.join(details)})" if details else ""
        evidence = guess.evidence
        if column.name in settings:
            role, evidence = "setting", "each of its values is a separate series"
        rows.append((judged.table.short_name(column), role, guess.unit, evidence))
    return rows
