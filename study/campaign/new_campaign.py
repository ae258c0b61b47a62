"""``stickslip campaign new``: drafts the manifest of a folder of test files."""

import os
import re
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from correlation.campaign.manifest import MANIFEST
from correlation.campaign.measured_files import MeasuredFiles
from correlation.campaign.read_campaign import check_campaign
from correlation.errors import CampaignError
from correlation.file.column import MeasuredFile
from correlation.file.format import MEASURED_FILES
from correlation.file.format.uff import NOT_READ
from correlation.file.read_file import read_file
from study.alike import merge_alike
from study.campaign.channel_name import name_channels
from study.campaign.column_role import Role
from study.campaign.convention import draft_conventions, keep_one_drive
from study.campaign.draft import Draft, Note, plain
from study.campaign.draft_frequency import (
    draft_frequency_responses,
    draft_stepped_sine,
    responses_with_phases,
    says_free,
    sensor_signs,
)
from study.campaign.draft_load_cell import draft_load_cells
from study.campaign.draft_mode import draft_modes
from study.campaign.draft_time import draft_loops, draft_record, draft_ring_downs, draft_steady_states
from study.campaign.drive_channel import choose_drive
from study.campaign.level import LEVEL_IN_NAME
from study.campaign.note import list_notes, unused_columns, unused_file
from study.campaign.question import Answers
from study.campaign.repeat import mark_settling, number_repeats
from study.campaign.suspicion import list_suspicions
from study.campaign.table import file_stem, split_tables
from study.campaign.table_kind import JudgedTable, Kind, judge_table

#: Words in the name of a group that stand beside the level or number of a run.
OF_A_RUN = {"level", "rep", "repeat", "repetition"}
WAY = re.compile(r"(?<![a-z])(up|down)(?![a-z])[_ /-]?", re.IGNORECASE)
#: Entry of the manifest that a message names: "campaign.toml: ring_down[3]".
NAMED_ENTRY = re.compile(r"\b(run|frf|ring_down|loop|mode|record)\[(\d+)\]")
NAMED_SENSOR = re.compile(r'sensor "(.+?)" (?:reads|has no rows)')
NAMED_TEST = re.compile(r'test "(.+?)"')
NAMED_RECORD = re.compile(r'record "(.+?)"')
#: Reasons that an error names.
SHOWN = 4
#: Files that stand beside measurements.
BESIDE = {".toml", ".md", ".json", ".py", ".m", ".png", ".jpg", ".jpeg", ".pdf", ".docx", ".svg", ".ini", ".log", ""}


@dataclass(frozen=True, kw_only=True, eq=False)
class NewCampaign:
    """What was drafted.

    Parameters
    ----------
    path
        Manifest that was written.
    draft
        Draft.
    suspicions
        What looks wrong in the data.
    """

    path: Path
    draft: Draft
    suspicions: tuple[str, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class FolderFiles:
    """Measured files of a folder.

    Parameters
    ----------
    folder
        Folder.
    files
        Files that could be read, by their names.
    unreadable
        Why others could not, by their names.
    """

    folder: Path
    files: dict[str, MeasuredFile]
    unreadable: dict[str, str]


def read_folder(
    folder: Path, *, overwrite: bool = False, report: Callable[[float, float], None] = lambda _done, _total: None
) -> FolderFiles:
    """Read all measured files of a folder.

    Parameters
    ----------
    folder
        Folder with files of test programs.
    overwrite
        Whether a manifest that is there may be replaced.
    report
        Called with how many files are read, and how many there are.

    Raises
    ------
    CampaignError
        No such folder, or a manifest that is there.
    """
    path = folder / MANIFEST
    if not folder.is_dir():
        raise CampaignError(f'there is no folder "{folder}"; give the one with the files of the test')
    if path.exists() and not overwrite:
        raise CampaignError(f'"{path}" is there already; remove it, or replace it by --force')
    suffixes = tuple(suffix for format_ in MEASURED_FILES for suffix in format_.suffixes)
    paths = [
        path
        for path in sorted(folder.iterdir())
        if path.is_file()
        and not path.name.startswith(".")
        and (path.suffix.lower() not in BESIDE or path.name.lower().endswith(suffixes))
    ]
    files: dict[str, MeasuredFile] = {}
    unreadable: dict[str, str] = {}
    for number, path in enumerate(paths):
        report(number, len(paths))
        try:
            files[path.name] = read_file(path)
        except CampaignError as error:
            unreadable[path.name] = str(error)
    return FolderFiles(folder=folder, files=files, unreadable=unreadable)


def draft_campaign(measured: FolderFiles, answers: Answers) -> Draft:
    """Draft the manifest of a folder.

    Parameters
    ----------
    measured
        Its files.
    answers
        Where what the files cannot say comes from.

    Raises
    ------
    CampaignError
        No usable file.
    """
    folder = measured.folder
    draft = Draft(title=folder.resolve().name, answers=answers)
    for name, reason in measured.unreadable.items():
        sentence = reason.removeprefix(name).lstrip(":, ")
        draft.notes.append(Note(file=name, columns="", role="cannot be read", unit="", evidence=sentence))
        draft.left_out.append(reason)
    by_file = {name: [judge_table(table) for table in split_tables(file)] for name, file in measured.files.items()}
    judged = [choose_drive(draft, table) for tables in by_file.values() for table in tables]
    draft.notes += list_notes(judged)
    for name, tables in by_file.items():
        if reason := unused_file(measured.files[name], tables):
            draft.left_out.append(reason)
            if not tables:
                why = reason.removeprefix(f"{name}: ")
                draft.notes.append(Note(file=name, columns="", role=Kind.NOT_USED.value, unit="", evidence=why))
        draft.left_out += [sentence for table in tables for sentence in unused_columns(table)]
    _draft_tables(draft, name_channels(judged))
    draft_load_cells(draft)
    draft_modes(draft, measured.files)
    draft.left_out += [
        f"{name}: datasets of the types {types}, which are not read"
        for name, file in measured.files.items()
        if (types := file.facts.get(NOT_READ))
    ]
    draft.suspicions += list_suspicions(judged)
    number_repeats(draft, measured.files)
    if draft.entries["record"] and not draft.is_comparable:
        draft.suspicions.append(
            "there are time records alone, which no command compares: add sines, ring-downs or frequency responses; a "
            "record with a force gives these by [[frf]] with time, force and an estimator (docs/campaign.md)"
        )
    if draft.is_empty:
        raise _nothing(draft, folder)
    return draft


def write_manifest(measured: FolderFiles, draft: Draft) -> NewCampaign:
    """Write a draft, without entries that `read_campaign` refuses.

    Parameters
    ----------
    measured
        Files of the campaign.
    draft
        Draft, which loses these entries.

    Raises
    ------
    CampaignError
        Nothing is left: the whole draft is written, to be edited.
    """
    path, whole = measured.folder / MANIFEST, draft.text()
    try:
        suspicions = _keep_readable(draft, measured)
    except CampaignError as error:
        path.write_text(whole, encoding="utf-8")
        raise CampaignError(f'{error}; the draft with all entries is in "{path}", to be mended there') from None
    path.write_text(draft.text(), encoding="utf-8")
    return NewCampaign(path=path, draft=draft, suspicions=(*draft.suspicions, *suspicions))


def _nothing(draft: Draft, folder: Path) -> CampaignError:
    reasons = [reason.rstrip(".") for reason in merge_alike(draft.left_out)]
    more = [f"and {len(reasons) - SHOWN} more"] if len(reasons) > SHOWN else []
    listed = "; ".join([*reasons[:SHOWN], *more]) or "it has no measured file"
    return CampaignError(f'nothing in "{folder}" can be compared with a model ({listed}); give measured files')


def _draft_tables(draft: Draft, judged: Sequence[JudgedTable]) -> None:
    """Entries of all tables, after what they have in common."""
    judged = keep_one_drive(draft, judged)
    stepped = [table for table in judged if table.kind in {Kind.STEPPED_SINE, Kind.STEADY_STATE}]
    responses = [table for table in judged if table.kind is Kind.FREQUENCY_RESPONSE]
    time_sign = draft_conventions(draft, [*stepped, *responses]) if stepped or responses else 1
    with_frequency = [table for table in [*stepped, *responses] if table.kind is not Kind.STEADY_STATE]
    signs = sensor_signs(draft, with_frequency, time_sign)
    tests = _test_names(stepped)
    for table in judged:
        if table.kind is Kind.STEPPED_SINE:
            test = tests[id(table)]
            draft_stepped_sine(draft, table, test, signs)
            _mark_settling(draft, table, test)
        elif table.kind is Kind.STEADY_STATE:
            draft_steady_states(draft, table, tests[id(table)])
        elif table.kind is Kind.FREQUENCY_RESPONSE:
            draft_frequency_responses(draft, table, signs)
        elif table.kind is Kind.RING_DOWN:
            draft_ring_downs(draft, table)
        elif table.kind is Kind.LOOP:
            draft_loops(draft, table)
        elif table.kind is Kind.RECORD:
            draft_record(draft, table)
        elif table.kind is Kind.TIDY:
            name = table.table.file.path.name
            draft.left_out.append(f"{name}: a tidy table: write [[test]] and [[sensor]] with its names")


def _test_names(tables: Sequence[JudgedTable]) -> dict[int, str]:
    """Test of each table: tables with equal columns are runs of one test, with the contacts or without."""
    groups: dict[tuple[str, ...], list[JudgedTable]] = {}
    for table in tables:
        # A level, a number or the way of a sweep in the name of a group tells a run, not a test.
        shape = re.sub(r"[({\[]\d+[)}\]]|[_ -]?\d+$", "", LEVEL_IN_NAME.sub("", WAY.sub("", table.table.path)))
        names = [table.table.short_name(column) for column in table.table.columns]
        free = "free" if says_free(file_stem(table.table.file.path.name)) else ""
        groups.setdefault((table.kind.value, shape, free, *names), []).append(table)
    result: dict[int, str] = {}
    taken: set[str] = set()
    for (kind, shape, *_), members in groups.items():
        stem = _common_start([file_stem(member.table.file.path.name) for member in members])
        own = shape.rpartition(".")[2].rpartition("/")[2]
        words = [word for word in re.split(r"[_ -]+", own) if word and word.lower() not in OF_A_RUN]
        name = ("_".join(words) if own.strip("_- ") else "") or stem.rstrip("_- .0123456789") or kind
        while name in taken:
            name += "'"
        taken.add(name)
        result |= {id(member): name for member in members}
    return result


def _common_start(names: Sequence[str]) -> str:
    """The letters with which all names begin."""
    first, last = min(names), max(names)
    return next((first[:n] for n, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), first)


def _mark_settling(draft: Draft, judged: JudgedTable, test: str) -> None:
    frequency = judged.of_role(Role.FREQUENCY)[0]
    mask = judged.mask(judged.rows()[0])
    sizes = [np.abs(column.values[mask]) for column, _ in responses_with_phases(judged)]
    mark_settling(draft, test, frequency.values[mask], sizes)


def _keep_readable(draft: Draft, measured: FolderFiles) -> list[str]:
    """Leave out entries that `read_campaign` refuses, one after the other; returns what it suspects."""
    folder = measured.folder
    files = [path for path in folder.iterdir() if path.is_file() and path.name != MANIFEST]
    # Within the folder, so that files have second names there: a campaign reads no file outside its own folder.
    with tempfile.TemporaryDirectory(dir=folder, prefix=".") as trial:
        for path in files:
            _name_again(path.resolve(), Path(trial) / path.name)
        while True:
            (Path(trial) / MANIFEST).write_text(draft.text(), encoding="utf-8")
            try:
                files_again = MeasuredFiles(folder=Path(trial), known=dict(measured.files))
                return [str(suspicion) for suspicion in check_campaign(files_again).suspicions]
            except CampaignError as error:
                if not _leave_out(draft, str(error)):
                    raise CampaignError(f"the draft cannot be read: {error}") from None
            if draft.is_empty:
                raise _nothing(draft, folder)


def _name_again(file: Path, name: Path) -> None:
    """A second name of a file, or a copy where its disk gives none."""
    try:
        os.link(file, name)
    except OSError:
        shutil.copyfile(file, name)


def _leave_out(draft: Draft, message: str) -> bool:
    """Take entries that a message names out of a draft; whether there were any."""
    lines = message.splitlines()
    doomed: dict[tuple[str, int], str] = {}
    for line in lines:
        match, record = NAMED_ENTRY.search(line), NAMED_RECORD.search(line)
        if match and int(match[2]) <= len(draft.entries[match[1]]):
            doomed[match[1], int(match[2]) - 1] = line
        elif record:
            names = [entry["name"] for entry in draft.entries["record"]]
            if record[1] in names:
                doomed["record", names.index(record[1])] = line
    dead = NAMED_SENSOR.search(message)
    if not doomed and dead:
        for kind in ("run", "frf"):
            for entry in draft.entries[kind]:
                entry["columns"].pop(dead[1], None)
            draft.entries[kind] = [entry for entry in draft.entries[kind] if _has_sensor(draft, entry)]
        draft.left_out.append(" ".join(message.split()))
        _drop_unused(draft)
        return True
    test = NAMED_TEST.search(message)
    if not doomed and test:
        runs = [number for number, run in enumerate(draft.entries["run"]) if run["test"] == test[1]]
        doomed = {("run", number): message for number in runs[-1:]}
    for (kind, number), line in sorted(doomed.items(), reverse=True):
        entry = draft.entries[kind].pop(number)
        called = entry.get("name", entry.get("file"))
        draft.left_out.append(f'{kind} "{called}": {line.partition(": ")[2]}')
    _drop_unused(draft)
    return bool(doomed)


def _has_sensor(draft: Draft, entry: Mapping[str, Any]) -> bool:
    return any(draft.named("sensor", name) for name in entry["columns"])


def _drop_unused(draft: Draft) -> None:
    """Remove sensors and tests that no entry uses."""
    used: set[str] = set()
    for kind in ("run", "frf"):
        used |= {name for entry in draft.entries[kind] for name in entry["columns"]}
    used |= {entry["sensor"] for entry in draft.entries["ring_down"]}
    used |= {name for entry in draft.entries["mode"] for name in plain(entry.get("shape", {}))}
    used |= {name for entry in draft.entries["record"] for name in entry["units"]}
    draft.entries["load_cells"] = [entry for entry in draft.entries["load_cells"] if {*entry["cells"]} <= used]
    used |= {entry[force] for entry in draft.entries["load_cells"] for force in ("tangential", "normal")}
    draft.entries["sensor"] = [entry for entry in draft.entries["sensor"] if entry["name"] in used]
    tests = {entry["test"] for entry in draft.entries["run"]}
    draft.entries["test"] = [entry for entry in draft.entries["test"] if entry["name"] in tests]
    if not (draft.entries["test"] or draft.entries["frf"]):
        draft.single.clear()
