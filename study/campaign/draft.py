"""Draft of ``campaign.toml``: its tables, with assumptions marked, written as TOML with comments."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import tomlkit
from tomlkit.items import InlineTable, Item, Table

from correlation.file.column import make_unique_names
from geometry.name_list import MAX_NAMES, join_first_names
from study.campaign.question import Answers, Marked, Question
from study.campaign.table_kind import JudgedTable

#: Kinds of entries whose equal names get numbers.
NAMED = ("frf", "ring_down", "loop", "record")
#: Kinds of entries of the manifest with data, and all kinds, in the order of the file.
DATA = ("run", "frf", "ring_down", "loop", "mode", "record")
ENTRIES = ("sensor", "load_cells", "test", *DATA)
#: Names of kinds of entries in sentences, if they differ from the keys of the manifest.
CALLED = {"frf": "frequency response", "ring_down": "ring-down", "load_cells": "pair of load cells"}
HEAD = """\
Drafted by `stickslip campaign new`. Check every line with "assumed": these values are not stated in the files.
docs/campaign.md describes the keys."""


@dataclass(frozen=True, kw_only=True)
class Note:
    """Interpretation of some columns: one row of the table that the command prints."""

    file: str
    columns: str
    role: str
    unit: str
    evidence: str


class Run(dict[str, Any]):
    """Entry of a run, with the table from which it was drafted.

    Parameters
    ----------
    entry
        Keys of the manifest.
    judged
        Its table.
    """

    def __init__(self, entry: Mapping[str, Any], judged: JudgedTable) -> None:
        super().__init__(entry)
        self.judged = judged

    @property
    def name(self) -> str:
        """File, and group and set of channels in the file."""
        return self.judged.table.place


@dataclass(kw_only=True)
class ManifestDraft:
    """Draft of a manifest, extended table by table.

    Parameters
    ----------
    title
        Title of the campaign.
    answers
        Source of answers to questions that the files leave open.
    single
        Single tables: drive, convention, units.
    entries
        Entries of the arrays of tables, by their kind; values are plain, `Marked`, or tables of these.
    motions
        Quantities of sensors according to their phases, by the names of the sensors.
    notes
        Interpretation of the columns.
    suspicions
        Suspected mistakes, with evidence.
    left_out
        Sentences on data that cannot be used, with the reason.
    """

    title: str
    answers: Answers
    single: dict[str, dict[str, Any]] = field(default_factory=dict)
    entries: dict[str, list[dict[str, Any]]] = field(default_factory=lambda: {kind: [] for kind in ENTRIES})
    motions: dict[str, Marked] = field(default_factory=dict)
    notes: list[Note] = field(default_factory=list)
    suspicions: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)

    def ask(self, text: str, default: str, why: str, *choices: str) -> Marked:
        """Ask a question; parameters as in `Question`."""
        return self.answers.ask(Question(text=text, default=default, why=why, choices=choices))

    def named(self, kind: str, name: str) -> dict[str, Any] | None:
        """Entry of a kind with a name; None if there is none yet."""
        return next((entry for entry in self.entries[kind] if entry["name"] == name), None)

    def number_names(self) -> None:
        """Number entries of the same kind and name, so that messages can refer to one of them."""
        for kind in NAMED:
            names = [str(without_marks(entry["name"])) for entry in self.entries[kind]]
            for entry, name, unique in zip(self.entries[kind], names, make_unique_names(names, "{} {}"), strict=True):
                if unique != name:
                    entry["name"] = unique

    @property
    def is_empty(self) -> bool:
        """Whether the draft has no data."""
        return not any(self.entries[kind] for kind in DATA)

    @property
    def is_comparable(self) -> bool:
        """Whether there are data to compare with a model; records alone are not compared."""
        return any(self.entries[kind] for kind in DATA if kind != "record")

    def assumptions(self) -> list[str]:
        """Sentences on the assumptions; entries with the same assumption are in one sentence."""
        groups: dict[tuple[str, str, str], _Assumption] = {}
        singles = {name: [table] for name, table in self.single.items()}
        for kind, entries in {**singles, **self.entries}.items():
            for entry in entries:
                name = name_entry(entry)
                for key, value, reason in list_marked_values(entry):
                    # Different numbers with one reason, such as those of repeats, are one assumption.
                    is_number = isinstance(value, int | float) and not isinstance(value, bool)
                    same = groups.setdefault((key, "" if is_number else _format(value), reason), _Assumption())
                    same.values.setdefault(_format(value))
                    same.names.setdefault(kind, []).append(name)
        return [
            f"{_name_all(assumption.names, self.entries)}: {key} = {_join_names([*assumption.values])}: {reason}"
            for (key, _, reason), assumption in groups.items()
        ] + [sentence for sentence in [self.run_order()] if sentence]

    def run_order(self) -> str:
        """Sentence on the assumed order of measurement of the runs; empty if there is nothing to order."""
        runs = [run for run in self.entries["run"] if "order" not in run["columns"]]
        if len(runs) < 2:
            return ""
        files = dict.fromkeys(str(without_marks(run["file"])) for run in runs)
        order = "that of their file names" if len(files) > 1 else f"that in {next(iter(files))}"
        why = "sort them by time of measurement, since earlier runs change the state of the contacts"
        return f"order of the {len(runs)} runs = {order}: {why}"

    def text(self) -> str:
        """Text of the manifest, as TOML."""
        document = tomlkit.document()
        for line in HEAD.splitlines():
            document.add(tomlkit.comment(line))
        document.add("schema", tomlkit.item(1))
        document.add("title", tomlkit.item(self.title))
        for name, table in self.single.items():
            document.add(name, _make_table(table))
        for kind, entries in self.entries.items():
            if kind == "run" and (order := self.run_order()):
                document.add(tomlkit.nl())
                document.add(tomlkit.comment(f"assumed: {order}"))
            if entries:
                array = tomlkit.aot()
                for entry in entries:
                    array.append(_make_table(entry))
                document.add(kind, array)
        for sentence in self.left_out:
            document.add(tomlkit.nl())
            document.add(tomlkit.comment(f"left out: {' '.join(sentence.split())}"))
        return tomlkit.dumps(document)


@dataclass(frozen=True, kw_only=True)
class _Assumption:
    """Values that were assumed for the same reason, and the names of their entries by kind."""

    values: dict[str, None] = field(default_factory=dict)
    names: dict[str, list[str]] = field(default_factory=dict)


def name_entry(entry: Mapping[str, Any]) -> str:
    """Name of an entry in messages: its name, or its file and the group in the file."""
    return entry.name if isinstance(entry, Run) else str(without_marks(entry.get("name", entry.get("file", ""))))


def assumed(value: Any) -> str:
    """Reasons why a value, or values in a table, were assumed; empty if none was."""
    if isinstance(value, Marked):
        return value.assumed
    if isinstance(value, Mapping):
        return "; ".join(dict.fromkeys(reason for inner in value.values() if (reason := assumed(inner))))
    return ""


def list_marked_values(entry: Mapping[str, Any]) -> Iterator[tuple[str, Any, str]]:
    """Keys, values and reasons of the assumptions in an entry and its tables."""
    for key, value in entry.items():
        if isinstance(value, Mapping):
            for inner, shown, reason in list_marked_values(value):
                yield inner if key == "columns" else f'{inner} of "{key}"', shown, reason
        elif isinstance(value, Marked) and value.assumed:
            yield key, value.value, value.assumed


def without_marks(value: Any) -> Any:
    """Plain value, without the marks of assumptions in it or its tables."""
    if isinstance(value, Marked):
        return without_marks(value.value)
    if isinstance(value, Mapping):
        return {key: without_marks(inner) for key, inner in value.items()}
    return value


def _make_table(entry: Mapping[str, Any]) -> Table:
    table = tomlkit.table()
    for key, value in entry.items():
        # Columns and coherences are written as tables, tables within these as inline tables.
        if key in {"columns", "coherence"}:
            table.add(key, _make_table(value))
            continue
        item = _make_item(without_marks(value))
        reason = assumed(value)
        if reason:
            item.comment(f"assumed: {reason}")
        table.add(key, item)
    return table


def _make_item(value: Any) -> Item:
    if not isinstance(value, Mapping):
        item: Item = tomlkit.item(value)
        return item
    inline: InlineTable = tomlkit.inline_table()
    for key, inner in value.items():
        inline.append(key, _make_item(inner))
    return inline


def _format(value: Any) -> str:
    """Value as in the manifest, without quotes."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def _join_names(values: Sequence[str]) -> str:
    if len(values) > MAX_NAMES + 1:
        return f"{', '.join(values[: MAX_NAMES - 1])}, ... {values[-1]}"
    return ", ".join(values)


def _name_all(names: Mapping[str, Sequence[str]], entries: Mapping[str, Sequence[Any]]) -> str:
    """Entries of several kinds, in words."""
    return ", ".join(_name_kind(kind, own, len(entries.get(kind, ()))) for kind, own in names.items())


def _name_kind(kind: str, names: Sequence[str], count: int) -> str:
    """Entries of one kind, in words: sensors "a", "b", or all 9 sensors."""
    different = [name for name in dict.fromkeys(names) if name]
    word = CALLED.get(kind, kind)
    if not different:
        return word
    if len(names) == count > MAX_NAMES:
        return f"all {count} {word}s"
    shown = join_first_names([f'"{name}"' for name in different])
    return f"{word if len(names) == 1 else f'{word}s'} {shown}"
