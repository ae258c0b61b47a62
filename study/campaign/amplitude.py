"""Convention of amplitudes (peak, rms or peak to peak), from units, names and texts of a file."""

import re
from collections.abc import Sequence
from functools import cache

from correlation.file.column import Column
from correlation.file.unit_label import find_amplitude_in_words, find_amplitude_of_unit, find_suffix, find_unit
from study.campaign.column_role import Role
from study.campaign.draft import ManifestDraft
from study.campaign.question import Marked
from study.campaign.table_kind import JudgedTable, Kind

CONVENTIONS = ("peak", "rms", "peak to peak")
#: Words of averaging: an rms average of spectra does not determine the convention of their amplitudes.
AVERAGED = re.compile(r"averag|mittel|mean", re.IGNORECASE)
#: Topics of a text from which the convention of amplitudes is read.
OF_AMPLITUDES = re.compile(r"amplitude|scal|skal|spectr|spektr|detect|format|line \d", re.IGNORECASE)


def find_stated_amplitude(judged: JudgedTable, column: Column) -> str:
    """Convention of the amplitudes of a column by its unit, its name or the texts of the file; empty if not stated."""
    label = column.label or column.name
    in_units = [column.unit_label, find_unit(label).unit, find_suffix(label)[0].replace("_", " ")]
    by_label = next(
        (kind for text in in_units if (kind := find_amplitude_of_unit(text))), ""
    ) or find_amplitude_in_words(label)
    if by_label:
        return by_label
    facts = {**judged.table.file.facts, **column.facts}
    result = {word for key, text in facts.items() if (word := _find_in_text(f"{key}: {text}"))}
    return result.pop() if len(result) == 1 else ""


@cache  # a file may have thousands of texts, which are read for each of its columns
def _find_in_text(text: str) -> str:
    """Convention of amplitudes stated in a text on them; empty if not stated."""
    return find_amplitude_in_words(text) if OF_AMPLITUDES.search(text) and not AVERAGED.search(text) else ""


def draft_amplitude(draft: ManifestDraft, tables: Sequence[JudgedTable]) -> str | Marked:
    """Convention of the amplitudes of all stepped sines; a column with another convention has it in its own entry.

    The convention of the force applies to columns without a stated one. If none or several are stated for the force,
    the user is asked.

    Parameters
    ----------
    draft
        Draft, for questions.
    tables
        Stepped sines, steady states and frequency responses.
    """
    stepped = [table for table in tables if table.kind is Kind.STEPPED_SINE]
    if not stepped:
        return "peak"
    of_drive, of_response = (
        {find_stated_amplitude(table, column) for table in stepped for column in table.of_role(*roles)}
        for roles in ((Role.FORCE, Role.LEVEL), (Role.RESPONSE,))
    )
    if len(of_drive - {""}) == 1:
        kind = next(iter(of_drive - {""}))
        silent = "" in of_drive | of_response
        return Marked(value=kind, assumed="stated for the force, not for the other columns") if silent else kind
    why = "not stated in any file; it scales all amplitudes"
    if of_response - {""}:
        listed = ", ".join(sorted(of_response - {""}))
        why = f"for columns that do not state it; responses stated as {listed} have it in their entries"
    text = "Are the amplitudes peak, rms or peak-to-peak values?"
    return draft.ask(text, "peak", why, *CONVENTIONS)


def own_amplitude(draft: ManifestDraft, judged: JudgedTable, column: Column) -> dict[str, str]:
    """Entry of a column for its amplitudes, if their convention differs from that of the campaign; else empty."""
    convention = draft.single.get("convention", {}).get("amplitude", "peak")
    common = convention.value if isinstance(convention, Marked) else convention
    kind = find_stated_amplitude(judged, column)
    return {"convention": kind} if kind not in {"", common} else {}
