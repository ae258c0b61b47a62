"""Which channel of steady states drives the structure, where no file says it."""

from dataclasses import replace
from typing import Any

from correlation.file.column import Column
from study.campaign.column_role import Role
from study.campaign.draft import ManifestDraft
from study.campaign.question import Marked
from study.campaign.table_kind import JudgedTable, Kind, list_unnamed_channels

#: Begins the evidence of a channel that nobody named.
ASSUMED = "assumed: "


def choose_drive(draft: ManifestDraft, judged: JudgedTable) -> JudgedTable:
    """A table whose drive is one of its channels: the phases of steady states count from it.

    Parameters
    ----------
    draft
        Draft that asks.
    judged
        Any table; only steady states over time without a force change.
    """
    channels = list_unnamed_channels(judged) if judged.kind is Kind.STEADY_STATE else []
    if not channels:
        return judged
    names = [column.name for column in channels]
    answer = draft.ask(
        f"Which channel of the steady states drives the structure ({', '.join(names[:6])})?", names[0],
        "not stated in the file; usually the first",
    )  # fmt: skip
    chosen = str(answer.value) if answer.value in names else names[0]
    why = f"{ASSUMED}{answer.assumed}" if answer.assumed else "your answer"
    guess = judged.columns[chosen]
    drive = replace(guess, role=Role.FORCE, quantity="voltage", unit=guess.unit or "V", evidence=why, stem="")
    return replace(judged, columns={**judged.columns, chosen: drive})


def mark_drive(judged: JudgedTable, force: Column, entry: Any) -> Any:
    """The entry of a drive, marked if its channel was assumed."""
    evidence = judged.columns[force.name].evidence
    return Marked(value=entry, assumed=evidence[len(ASSUMED) :]) if evidence.startswith(ASSUMED) else entry
