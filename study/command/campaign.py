"""``stickslip campaign new``: draft the manifest of a folder of test files from their contents."""

import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from study.run_context import DEFAULTS, Answer, Options, make_command_app

if TYPE_CHECKING:
    from study.campaign.new_campaign import NewCampaign

app = make_command_app(
    "campaign",
    """`campaign new FOLDER` reads all files of a folder (CSV, UFF, MATLAB, HDF5, WAV, TDMS), recognises frequency
    responses, stepped sines, ring-downs, loops, steady states and time records, and drafts campaign.toml, which
    `compare` and `diagnose` read. It asks for what is not stated in the files, such as the places of sensors.
    With --yes it asks nothing and marks every assumption with a comment. docs/campaign_new.md describes what is
    recognised, docs/campaign.md the keys of the manifest, docs/measured_files.md the formats.""",
    examples=["stickslip campaign new measured", "stickslip campaign new measured --yes --force"],
)


@app.command(name="new")
def new(
    folder: Annotated[Path, Parameter(help="Folder with the measured files.")],
    /,
    *,
    yes: Annotated[bool, Parameter(negative="", help="Do not ask: use defaults, marked as assumed.")] = False,
    force: Annotated[bool, Parameter(negative="", help="Replace an existing campaign.toml.")] = False,
    options: Options = DEFAULTS,
) -> Answer:
    """Draft the manifest of a folder of test files."""
    from geometry.errors import InputError
    from study.campaign.new_campaign import draft_campaign, read_folder, write_manifest
    from study.campaign.question import Assumptions, Terminal
    from study.measured_campaign import keep_analyses

    if not (yes or sys.stdin.isatty()):
        raise InputError(
            "questions cannot be asked: standard input is not a terminal; add --yes, which uses defaults and marks them"
        )
    run = options.open(place=folder)
    with run.progress.step("read the files") as report:
        measured = read_folder(folder, overwrite=force, report=report)
    draft = draft_campaign(measured, Assumptions() if yes else Terminal())
    with run.progress.step("try the manifest"):
        drafted = write_manifest(measured, draft, keep_analyses(run.store))
    return Answer(document=make_document(drafted), text=format_report(drafted))


def make_document(drafted: "NewCampaign") -> dict[str, object]:
    """Make the answer for ``--json``."""
    return {
        "manifest": str(drafted.path),
        "understood": [dict(vars(note)) for note in drafted.draft.notes],
        "assumed": drafted.draft.assumptions(),
        "left_out": drafted.draft.left_out,
        "suspicions": list(drafted.suspicions),
    }


def format_report(drafted: "NewCampaign") -> str:
    """Format the answer as text: a table of recognised columns, then assumptions, omissions and suspicions."""
    from study.merge_sentences import merge_similar

    draft = drafted.draft
    rows = [("file", "columns", "is", "unit", "because")]
    rows += [(note.file, note.columns, note.role, note.unit, note.evidence) for note in draft.notes]
    widths = [min(34, max(len(row[column]) for row in rows)) for column in range(4)]
    lines = [
        "  ".join(
            [*(_cut(text, width).ljust(width) for text, width in zip(row, widths, strict=False)), row[4]]
        ).rstrip()
        for row in rows
    ]
    for title, sentences in (
        ("Assumed, because it is not stated in any file (check these):", draft.assumptions()),
        ("Left out:", merge_similar(draft.left_out, naming_all=True)),
        ("Suspected:", merge_similar(drafted.suspicions)),
    ):
        if sentences:
            lines += ["", title, *(f"  {' '.join(sentence.split())}" for sentence in sentences)]
    following = f"next: {_describe_first_step(drafted)}, then stickslip compare CASE {drafted.path.parent}"
    return "\n".join([*lines, "", f"written: {drafted.path}", *([following] if draft.is_comparable else [])])


def _describe_first_step(drafted: "NewCampaign") -> str:
    """Describe the next step of the user before a comparison is meaningful."""
    from study.campaign.draft import assumed

    sensors = drafted.draft.entries["sensor"]
    if sum(bool(assumed(sensor.get("place"))) for sensor in sensors) < 2:
        return "check the assumptions"
    # Several sensors whose places are only assumed do not measure a shape.
    text = drafted.path.read_text(encoding="utf-8").splitlines()
    lines = [str(number) for number, line in enumerate(text, start=1) if re.match(r"place = .* # assumed: ", line)]
    return f"edit the assumed places of the sensors in {drafted.path} (lines {', '.join(lines)})"


def _cut(text: str, width: int) -> str:
    return text if len(text) <= width else text[: width - 3] + "..."
