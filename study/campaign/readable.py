"""Removal of the entries of a draft that `read_campaign` refuses."""

import os
import re
import shutil
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from correlation.campaign.manifest import MANIFEST
from correlation.campaign.measured_files import MeasuredFiles
from correlation.campaign.read_campaign import check_campaign
from correlation.data_type.registry import Analyse, analyse_uncached
from correlation.errors import CampaignError
from correlation.file.column import MeasuredFile
from pipeline.fingerprint import key
from study.campaign.draft import ManifestDraft, name_entry, without_marks
from study.merge_sentences import merge_similar

#: Entry of the manifest in a message: "campaign.toml: ring_down[3]".
NAMED_ENTRY = re.compile(r"\b(run|frf|ring_down|loop|mode|record)\[(\d+)\]")
NAMED_SENSOR = re.compile(r'sensor "(.+?)" (?:reads|has no rows)')
NAMED_TEST = re.compile(r'test "(.+?)"')
NAMED_RECORD = re.compile(r'record "(.+?)"')
#: Largest number of reasons in an error.
SHOWN = 4


def make_nothing_left_error(draft: ManifestDraft, folder: Path) -> CampaignError:
    """Error with the reasons why nothing of a folder can be used."""
    reasons = [reason.rstrip(".") for reason in merge_similar(draft.left_out)]
    more = [f"and {len(reasons) - SHOWN} more"] if len(reasons) > SHOWN else []
    listed = "; ".join([*reasons[:SHOWN], *more]) or "it contains no measured file"
    return CampaignError(f'nothing in "{folder}" can be compared with a model ({listed}); give measured files')


def keep_readable(
    draft: ManifestDraft, folder: Path, measured: Mapping[str, MeasuredFile], analyse: Analyse = analyse_uncached
) -> list[str]:
    """Remove entries that `read_campaign` refuses, and try again until it accepts the rest.

    Parameters
    ----------
    draft
        Draft; refused entries are removed from it.
    folder
        Folder of the campaign.
    measured
        Files of the campaign by their names.
    analyse
        Analysis of data, as in `read_campaign`; its results are reused in further trials.

    Returns
    -------
    Suspicions of `read_campaign` on the remaining entries.

    Raises
    ------
    CampaignError
        If no entry remains, or the error names none to remove.
    """
    analyse = _analyse_once(analyse)
    files = [path for path in folder.iterdir() if path.is_file() and path.name != MANIFEST]
    # A campaign reads no file outside its folder: the trial folder has hard links, within the same file system.
    with tempfile.TemporaryDirectory(dir=folder, prefix=".") as trial:
        for path in files:
            _link_or_copy(path.resolve(), Path(trial) / path.name)
        while True:
            (Path(trial) / MANIFEST).write_text(draft.text(), encoding="utf-8")
            try:
                files_again = MeasuredFiles(folder=Path(trial), known=dict(measured))
                return [str(suspicion) for suspicion in check_campaign(files_again, analyse).suspicions]
            except CampaignError as error:
                if not _leave_out(draft, str(error)):
                    raise CampaignError(f"the draft cannot be read: {error}") from None
            if draft.is_empty:
                raise make_nothing_left_error(draft, folder)


def _analyse_once(analyse: Analyse) -> Analyse:
    """Analysis that stores its results and computes each once."""
    known: dict[str, Any] = {}

    def analyse_or_remember(compute: Callable[..., Any], *args: Any, **words: Any) -> Any:
        which = key(compute.__qualname__, {"args": args, "words": words}, compute.__module__)
        if which not in known:
            known[which] = analyse(compute, *args, **words)
        return known[which]

    return analyse_or_remember


def _link_or_copy(file: Path, name: Path) -> None:
    """Make a hard link to a file, or a copy if its file system does not allow one."""
    try:
        os.link(file, name)
    except OSError:
        shutil.copyfile(file, name)


def _leave_out(draft: ManifestDraft, message: str) -> bool:
    """Remove the entries that a message names from a draft; return whether there were any."""
    lines = message.splitlines()
    removed: dict[tuple[str, int], str] = {}
    for line in lines:
        match, record = NAMED_ENTRY.search(line), NAMED_RECORD.search(line)
        if match and int(match[2]) <= len(draft.entries[match[1]]):
            removed[match[1], int(match[2]) - 1] = line
        elif record:
            names = [entry["name"] for entry in draft.entries["record"]]
            if record[1] in names:
                removed["record", names.index(record[1])] = line
    removed_sensors = {match[1]: line for line in lines if (match := NAMED_SENSOR.search(line))}
    if not removed and removed_sensors:
        for kind in ("run", "frf"):
            for entry in draft.entries[kind]:
                entry["columns"] = {
                    name: column for name, column in entry["columns"].items() if name not in removed_sensors
                }
            draft.entries[kind] = [entry for entry in draft.entries[kind] if _has_sensor(draft, entry)]
        draft.left_out += removed_sensors.values()
        _drop_unused(draft)
        return True
    test = NAMED_TEST.search(message)
    if not removed and test:
        runs = [number for number, run in enumerate(draft.entries["run"]) if run["test"] == test[1]]
        removed = {("run", number): message for number in runs[-1:]}
    reasons = [
        f'{kind} "{name_entry(draft.entries[kind][number])}": {_without_numbers(draft, kind, number, line)}'
        for (kind, number), line in sorted(removed.items())
    ]
    draft.left_out += reasons
    for kind, number in sorted(removed, reverse=True):
        del draft.entries[kind][number]
    _drop_unused(draft)
    return bool(removed)


def _without_numbers(draft: ManifestDraft, kind: str, number: int, line: str) -> str:
    """Reason in a message on an entry; numbers of other entries, which hold for one trial, are replaced by names."""

    def name(match: re.Match[str]) -> str:
        entries = draft.entries[match[1]]
        is_other = (match[1], int(match[2]) - 1) != (kind, number) and int(match[2]) <= len(entries)
        return f'"{name_entry(entries[int(match[2]) - 1])}"' if is_other else match[0]

    reason = line.partition(": ")[2].removeprefix(f"{kind}[{number + 1}]: ")
    return NAMED_ENTRY.sub(name, reason)


def _has_sensor(draft: ManifestDraft, entry: Mapping[str, Any]) -> bool:
    return any(draft.named("sensor", name) for name in entry["columns"])


def _drop_unused(draft: ManifestDraft) -> None:
    """Remove sensors and tests that no entry uses."""
    used: set[str] = set()
    for kind in ("run", "frf"):
        used |= {name for entry in draft.entries[kind] for name in entry["columns"]}
    used |= {entry["sensor"] for entry in draft.entries["ring_down"]}
    used |= {name for entry in draft.entries["mode"] for name in without_marks(entry.get("shape", {}))}
    used |= {name for entry in draft.entries["record"] for name in entry["units"]}
    draft.entries["load_cells"] = [entry for entry in draft.entries["load_cells"] if {*entry["cells"]} <= used]
    used |= {entry[force] for entry in draft.entries["load_cells"] for force in ("tangential", "normal")}
    draft.entries["sensor"] = [entry for entry in draft.entries["sensor"] if entry["name"] in used]
    tests = {entry["test"] for entry in draft.entries["run"]}
    draft.entries["test"] = [entry for entry in draft.entries["test"] if entry["name"] in tests]
    if not (draft.entries["test"] or draft.entries["frf"]):
        draft.single.clear()
