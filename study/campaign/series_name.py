"""Names of tests: files of equal columns are runs of one test, unless words of their names distinguish tests."""

from collections.abc import Sequence

from study.campaign.channel_set import AGAIN
from study.campaign.dataset_set import DATASET
from study.campaign.draft import ManifestDraft
from study.campaign.draft_frequency import (
    is_response_controlled,
    make_complex_force,
    pair_responses_with_phases,
    says_free,
)
from study.campaign.run_name import LENGTH_IN_NAME, QUANTITY_OF_COLUMN, list_condition_words, make_naming_scheme
from study.campaign.table import make_file_stem
from study.campaign.table_kind import JudgedTable, Kind

#: Kinds of tables whose entries have no test.
WITHOUT_TEST = {Kind.RING_DOWN, Kind.LOOP, Kind.FREQUENCY_RESPONSE}


def name_tests(draft: ManifestDraft, tables: Sequence[JudgedTable]) -> dict[int, str]:
    """Name of the test of each table, by the `id` of the table.

    Tables of equal columns are runs of one test. Words in the names of their files that denote neither a run, a level,
    a direction nor a sensor distinguish tests, "with_damper_1N" and "without_damper_1N", and so do quantities in the
    names of columns that are not levels, "Acc 1000rpm" and "Acc 2000rpm".

    Parameters
    ----------
    draft
        Draft, to which suspicions about tests that differ only by words are added.
    tables
        Stepped sines and steady states.
    """
    alike: dict[tuple[str, ...], dict[tuple[str, ...], list[JudgedTable]]] = {}
    for table in tables:
        shape = make_naming_scheme(table.table.path)
        names = _list_channels(table, tables)
        free = "free" if says_free(make_file_stem(table.table.file.path.name)) else ""
        same = alike.setdefault((table.kind.value, shape, free, *names), {})
        same.setdefault(_list_words(table), []).append(table)
    result: dict[int, str] = {}
    taken: set[str] = set()
    for (kind, shape, free, *_), groups in alike.items():
        own: list[str] = []
        for words, members in groups.items():
            stem = _find_common_start([make_file_stem(member.table.file.path.name) for member in members])
            name = shape.rpartition("/")[2] or stem.rstrip("_- .0123456789") or kind
            if len(groups) > 1:
                name = "_".join(words) or name
            if free and not says_free(name):
                name += f"_{free}"
            while name in taken:
                name += "'"
            taken.add(name)
            own.append(name)
            result |= {id(member): name for member in members}
        if len(own) > 1:
            draft.suspicions.append(
                f"tests {', '.join(own)}: they differ only by words in the names of files or columns: if these words "
                "mean repeats or sensors of one test, give their runs the same test, and separate repeats or sensors"
            )
    return result


def suspect_structures(tables: Sequence[JudgedTable]) -> list[str]:
    """Suspicions on groups or files of equal channels whose names may denote structures, "Fe.Out" and "Al.Out".

    Only ring-downs, loops and frequency responses are checked; other runs have tests, which `name_tests` distinguishes.
    """
    alike: dict[tuple[str, ...], list[JudgedTable]] = {}
    for judged in tables:
        if judged.kind in WITHOUT_TEST:
            names = sorted(judged.table.short_name(column) for column in judged.table.columns)
            alike.setdefault((judged.kind.value, *names), []).append(judged)
    sentences = []
    for members in alike.values():
        words = {judged.table.label: frozenset(_list_words(judged)) for judged in members}
        common = frozenset.intersection(*words.values())
        apart = {label: own - common for label, own in words.items()}
        if len(set(apart.values())) > 1 and all(apart.values()):
            sentences.append(
                f"{', '.join(apart)}: they differ only by words in the names of files or groups: if these mean "
                "different structures or set-ups, make a separate campaign of each"
            )
    return sentences


def _list_channels(judged: JudgedTable, tables: Sequence[JudgedTable]) -> list[str]:
    """Names of the channels of a table and of the other sets of channels in its group, which belong to one test."""
    own = judged.table
    beside = [own]
    if own.of_set:
        beside = [one.table for one in tables if one.table.file is own.file and one.table.path == own.path]
    names = [table.short_name(column) for table in beside for column in table.columns]
    # The names of datasets of one channel differ by a number, those of their abscissas by a number in brackets.
    return sorted({AGAIN.sub("", DATASET.sub("", name)) for name in names})


def _list_words(judged: JudgedTable) -> tuple[str, ...]:
    """Words in the names of a file and of columns that may distinguish tests, without those of sensors."""
    of_sensors = {word for guess in judged.columns.values() for word in guess.stem.split()}
    path = judged.table.path if judged.kind in WITHOUT_TEST else ""
    name = " ".join(
        [make_file_stem(judged.table.file.path.name), path, *QUANTITY_OF_COLUMN.findall(judged.table.of_set)]
    )
    if judged.kind is Kind.STEPPED_SINE and _is_response_controlled(judged):
        name = LENGTH_IN_NAME.sub("_", name)
    words = list_condition_words(name)
    return tuple(word for word in words if word.lower() not in of_sensors)


def _is_response_controlled(judged: JudgedTable) -> bool:
    force, pairs = make_complex_force(judged), pair_responses_with_phases(judged)
    return force is not None and is_response_controlled(judged, force, pairs[0][0], judged.rows()[0])


def _find_common_start(names: Sequence[str]) -> str:
    """Common beginning of all names."""
    first, last = min(names), max(names)
    return next((first[:n] for n, (a, b) in enumerate(zip(first, last, strict=False)) if a != b), first)
