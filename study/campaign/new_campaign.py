"""``stickslip campaign new``: draft of the manifest of a folder of test files."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from correlation.campaign.manifest import MANIFEST
from correlation.data_type.registry import Analyse, analyse_uncached
from correlation.errors import CampaignError
from correlation.file.column import MeasuredFile
from correlation.file.format import MEASURED_FILES
from correlation.file.format.uff import NOT_CLOSED, NOT_READ
from correlation.file.read_file import read_file
from correlation.file.text_table.read_table import DECIMALS
from study.campaign.channel_name import name_channels
from study.campaign.column_role import Role
from study.campaign.convention import draft_conventions, keep_one_drive
from study.campaign.draft import ManifestDraft, Note
from study.campaign.draft_frequency import draft_stepped_sine, pair_responses_with_phases
from study.campaign.draft_load_cell import draft_load_cells
from study.campaign.draft_mode import draft_mode_table, draft_modes
from study.campaign.draft_response import draft_frequency_responses
from study.campaign.draft_time import draft_loops, draft_record, draft_ring_downs, draft_steady_states
from study.campaign.drive_channel import choose_drive
from study.campaign.dwell import extend_steady_states
from study.campaign.find_tables import find_tables
from study.campaign.note import describe_unused_columns, describe_unused_file, list_notes
from study.campaign.question import Answers
from study.campaign.readable import keep_readable, make_nothing_left_error
from study.campaign.repeat import mark_settling, number_repeats
from study.campaign.repeat_doubt import doubt_repeats
from study.campaign.resonance_phase import find_sensor_motions, find_sensor_signs
from study.campaign.series_name import name_tests, suspect_structures
from study.campaign.suspicion import list_suspicions
from study.campaign.table_kind import JudgedTable, Kind, judge_table

#: Suffixes of files that are not read, unless their name ends like that of a measured file.
NOT_DATA = {".toml", ".md", ".json", ".py", ".m", ".png", ".jpg", ".jpeg", ".pdf", ".docx", ".svg", ".ini", ".log", ""}


#: Suffixes of such files that may contain numbers.
POSSIBLE_DATA = {".json", ".log", ""}


@dataclass(frozen=True, kw_only=True, eq=False)
class NewCampaign:
    """Result of the command.

    Parameters
    ----------
    path
        Written manifest.
    draft
        Draft.
    suspicions
        Suspected mistakes in the data.
    """

    path: Path
    draft: ManifestDraft
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
        Reasons why other files could not be read, by their names.
    subfolders
        Names of subfolders with measured files, which are not read.
    """

    folder: Path
    files: dict[str, MeasuredFile]
    unreadable: dict[str, str]
    subfolders: tuple[str, ...] = ()


def read_folder(
    folder: Path, *, overwrite: bool = False, report: Callable[[float, float], None] = lambda _done, _total: None
) -> FolderFiles:
    """Read all measured files of a folder.

    Parameters
    ----------
    folder
        Folder with files of test programs.
    overwrite
        Whether an existing manifest may be replaced.
    report
        Called with the number of files read and the number of all files.

    Raises
    ------
    CampaignError
        If the folder does not exist, or has a manifest that may not be replaced.
    """
    path = folder / MANIFEST
    if not folder.is_dir():
        raise CampaignError(f'there is no folder "{folder}"; give the one with the files of the test')
    if path.exists() and not overwrite:
        raise CampaignError(f'"{path}" already exists; remove it, or replace it with --force')
    paths = [path for path in sorted(folder.iterdir()) if _may_be_measured(path)]
    files: dict[str, MeasuredFile] = {}
    unreadable: dict[str, str] = {}
    for number, path in enumerate(paths):
        report(number, len(paths))
        try:
            files[path.name] = read_file(path)
        except CampaignError as error:
            unreadable[path.name] = str(error)
    below = tuple(one.name for one in sorted(folder.iterdir()) if one.is_dir() and _has_measured(one))
    return FolderFiles(folder=folder, files=files, unreadable=unreadable, subfolders=below)


def _may_be_measured(path: Path) -> bool:
    suffixes = tuple(suffix for format_ in MEASURED_FILES for suffix in format_.suffixes)
    name = path.name.lower()
    return (
        path.is_file() and not name.startswith(".") and (path.suffix.lower() not in NOT_DATA or name.endswith(suffixes))
    )


def _name_others(folder: Path) -> str:
    """Names of some files that are not read but may contain numbers; empty for none."""
    names = [path.name for path in sorted(folder.iterdir()) if path.is_file() and path.suffix.lower() in POSSIBLE_DATA]
    return ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")


def _has_measured(folder: Path) -> bool:
    """Whether a folder without a manifest has files that may be measured."""
    if folder.name.startswith(".") or (folder / MANIFEST).exists():
        return False
    return any(_may_be_measured(path) for path in folder.iterdir())


def draft_campaign(measured: FolderFiles, answers: Answers) -> ManifestDraft:
    """Draft the manifest of a folder.

    Parameters
    ----------
    measured
        Files of the folder.
    answers
        Source of answers to questions that the files leave open.

    Raises
    ------
    CampaignError
        If there is no usable file.
    """
    folder = measured.folder
    if not measured.files and not measured.unreadable and (others := _name_others(folder)):
        raise CampaignError(f'"{folder}" has no measured file of a known format, only {others}: save the data as CSV')
    draft = ManifestDraft(title=folder.resolve().name, answers=answers)
    for name, reason in measured.unreadable.items():
        sentence = reason.removeprefix(name).lstrip(":, ")
        draft.notes.append(Note(file=name, columns="", role="cannot be read", unit="", evidence=sentence))
        draft.left_out.append(reason)
    if measured.subfolders:
        draft.left_out.append(
            f"{', '.join(measured.subfolders)}: subfolders are not read: copy their files into {folder.name} with the "
            "folder name in each file name, or draft a campaign in each"
        )
    tables = {name: find_tables(file) for name, file in measured.files.items()}
    result = extend_steady_states([judge_table(table) for of_file, _ in tables.values() for table in of_file])
    by_file = {name: [one for one in result if one.table.file is file] for name, file in measured.files.items()}
    judged = [choose_drive(draft, table) for table in result]
    draft.notes += list_notes(judged)
    for name, of_file in by_file.items():
        if reason := describe_unused_file(measured.files[name], of_file):
            draft.left_out.append(reason)
            if not of_file:
                why = reason.removeprefix(f"{name}: ")
                draft.notes.append(Note(file=name, columns="", role=Kind.NOT_USED.value, unit="", evidence=why))
        draft.left_out += [sentence for table in of_file for sentence in describe_unused_columns(table)] + tables[name][
            1
        ]
    _draft_tables(draft, name_channels(judged))
    draft_load_cells(draft)
    draft_modes(draft, measured.files)
    draft.left_out += [
        f"{name}: datasets of the types {types} are not read"
        for name, file in measured.files.items()
        if (types := file.facts.get(NOT_READ))
    ]
    draft.suspicions += list_suspicions(judged)
    draft.suspicions += [
        f"{name} {doubt}"
        for name, file in measured.files.items()
        for fact in (NOT_CLOSED, DECIMALS)
        if (doubt := file.facts.get(fact))
    ]
    draft.number_names()
    number_repeats(draft)
    draft.suspicions += doubt_repeats(draft)
    if draft.entries["record"] and not draft.is_comparable:
        draft.suspicions.append(
            "there are only time records, which no command compares: add sines, ring-downs or frequency responses; "
            "[[frf]] with time, force and an estimator makes a frequency response from a record with a force "
            "(docs/campaign.md)"
        )
    if draft.is_empty:
        raise make_nothing_left_error(draft, folder)
    return draft


def write_manifest(measured: FolderFiles, draft: ManifestDraft, analyse: Analyse = analyse_uncached) -> NewCampaign:
    """Write a draft, without entries that `read_campaign` refuses.

    Parameters
    ----------
    measured
        Files of the campaign.
    draft
        Draft; refused entries are removed from it.
    analyse
        Analysis of data, as in `read_campaign`.

    Raises
    ------
    CampaignError
        If no entry remains, or the draft cannot be read; the complete draft is written, to be edited.
    """
    path, whole = measured.folder / MANIFEST, draft.text()
    try:
        suspicions = keep_readable(draft, measured.folder, measured.files, analyse)
    except CampaignError as error:
        path.write_text(whole, encoding="utf-8")
        raise CampaignError(f'{error}; the draft with all entries is in "{path}", to be corrected there') from None
    path.write_text(draft.text(), encoding="utf-8")
    return NewCampaign(path=path, draft=draft, suspicions=(*draft.suspicions, *suspicions))


def _draft_tables(draft: ManifestDraft, judged: Sequence[JudgedTable]) -> None:
    """Draft the common conventions of all tables, then their entries."""
    judged = keep_one_drive(draft, judged)
    stepped = [table for table in judged if table.kind in {Kind.STEPPED_SINE, Kind.STEADY_STATE}]
    responses = [table for table in judged if table.kind is Kind.FREQUENCY_RESPONSE]
    time_sign = draft_conventions(draft, [*stepped, *responses]) if stepped or responses else 1
    with_frequency = [table for table in [*stepped, *responses] if table.kind is not Kind.STEADY_STATE]
    signs = find_sensor_signs(draft, with_frequency, time_sign)
    draft.motions = find_sensor_motions(with_frequency, time_sign)
    tests = name_tests(draft, stepped)
    draft.suspicions += suspect_structures(judged)
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
        elif table.kind is Kind.MODES:
            draft_mode_table(draft, table)
        elif table.kind is Kind.RECORD:
            draft_record(draft, table)
        elif table.kind is Kind.TIDY:
            name = table.table.file.path.name
            draft.left_out.append(f"{name}: a tidy table: write [[test]] and [[sensor]] with its names")


def _mark_settling(draft: ManifestDraft, judged: JudgedTable, test: str) -> None:
    frequency = judged.of_role(Role.FREQUENCY)[0]
    mask = judged.mask(judged.rows()[0])
    sizes = [np.abs(column.values[mask]) for column, _ in pair_responses_with_phases(judged)]
    mark_settling(draft, test, frequency.values[mask], sizes)
