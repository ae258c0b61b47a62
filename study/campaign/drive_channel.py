"""Choice of the drive channel of steady states, if no file states it."""

from dataclasses import replace
from typing import Any

from correlation.file.column import Column
from study.campaign.column_role import Role
from study.campaign.draft import ManifestDraft
from study.campaign.question import Marked
from study.campaign.table_kind import JudgedTable, Kind, list_unnamed_channels

#: Beginning of the evidence of an assumed drive channel.
ASSUMED = "assumed: "


def choose_drive(draft: ManifestDraft, judged: JudgedTable) -> JudgedTable:
    """Choose the drive among the channels of a table; phases of steady states are relative to it.

    Parameters
    ----------
    draft
        Draft, for questions.
    judged
        Any table; only steady states over time without a force and without a recognised channel are changed.

    Returns
    -------
    Table with the chosen channel as the force.
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
    """Entry of a drive, marked if its channel was assumed."""
    evidence = judged.columns[force.name].evidence
    return Marked(value=entry, assumed=evidence[len(ASSUMED) :]) if evidence.startswith(ASSUMED) else entry
