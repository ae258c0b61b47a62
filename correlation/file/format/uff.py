"""Universal files (UFF, UNV): functions (58, 58b), nodes (15, 2411), shapes (55), units (164), title (151)."""

import re
from pathlib import Path

import numpy as np

from correlation.errors import CampaignError
from correlation.file.column import Column, MeasuredFile, MeasuredShape, Node
from correlation.file.format import MEASURED_FILES, MeasuredFileFormat
from correlation.file.uff.dataset import Dataset, split_datasets
from correlation.file.uff.dataset_15 import read_nodes
from correlation.file.uff.dataset_55 import read_shape
from correlation.file.uff.dataset_58 import Record58, read_58
from correlation.file.uff.units import FileUnits, read_units

#: Fact with the types of datasets that were skipped.
NOT_READ = "datasets that are not read"
#: Fact of a file that may be cut after its last dataset.
NOT_CLOSED = "end of the file"
BEGINNING = re.compile(rb"(?:[ \t]*\r?\n)*[ \t]{0,4}-1[ \t]*\r?\n[ \t]{0,6}\d{1,6}")


def recognise(head: bytes) -> bool:
    """Whether a file begins with a line of -1 and the number of a dataset."""
    return BEGINNING.match(head) is not None


def read(path: Path) -> MeasuredFile:
    """Read functions as columns, each with its abscissa as another column, nodes and shapes; skip other datasets."""
    datasets = list(split_datasets(path.name, path.read_bytes()))
    if not datasets:
        raise CampaignError(f"{path.name}: has no dataset; export it again")
    # Units apply to the whole file, also to datasets before them.
    units = next((read_units(dataset) for dataset in datasets if dataset.kind == 164), FileUnits())
    title, facts = _read_title(datasets)
    records: list[Record58] = []
    nodes: dict[int, Node] = {}
    shapes: list[MeasuredShape] = []
    others: list[str] = []
    for dataset in datasets:
        if dataset.kind == 58:
            records.append(read_58(dataset, units))
        elif dataset.kind in {15, 2411}:
            nodes |= read_nodes(dataset, units)
        elif dataset.kind == 55:
            shapes.append(read_shape(dataset, units))
        elif dataset.kind not in {151, 164}:
            others.append(str(dataset.kind))
    if units.described:
        facts["units"] = units.described
    if others:
        facts[NOT_READ] = ", ".join(dict.fromkeys(others))
    if not datasets[-1].is_closed:
        facts[NOT_CLOSED] = (
            f"does not end with a whole line of -1 behind dataset {len(datasets)}; if it is cut there, further "
            "datasets are lost: compare its length with the original"
        )
    return MeasuredFile(
        path=path, format="uff", title=title, columns=_with_abscissas(records), nodes=nodes, shapes=tuple(shapes),
        facts=facts,
    )  # fmt: skip


def _read_title(datasets: list[Dataset]) -> tuple[str, dict[str, str]]:
    """Title and facts of dataset 151."""
    for dataset in datasets:
        if dataset.kind == 151:
            dataset.require_at_most(8)
            keys = ("model", "description", "program of the model", "created", "saved", "program", "written")
            facts = {key: dataset.text(row).strip() for row, key in enumerate(keys) if row < len(dataset.lines)}
            facts = {key: text for key, text in facts.items() if text and text.upper() != "NONE"}
            return facts.get("model", ""), facts
    return "", {}


def _with_abscissas(records: list[Record58]) -> tuple[Column, ...]:
    """Columns of the functions, with one column for each different abscissa before its first function."""
    columns: list[Column] = []
    abscissas: dict[tuple[str, str, int], list[Column]] = {}
    names: dict[str, int] = {}
    for record in records:
        column, key = record.column, (record.abscissa_name, record.abscissa_unit, len(record.abscissa))
        same = abscissas.setdefault(key, [])
        shared = next((known for known in same if np.array_equal(known.values, record.abscissa, equal_nan=True)), None)
        if shared is None:
            names[record.abscissa_name] = count = names.get(record.abscissa_name, 0) + 1
            name = record.abscissa_name + (f" ({count})" if count > 1 else "")
            shared = Column(
                name=name, values=record.abscissa, unit=record.abscissa_unit, unit_label=record.abscissa_label,
                where=column.where,
                function=record.abscissa_name if record.abscissa_name in {"time", "frequency"} else "",
            )  # fmt: skip
            same.append(shared)
            columns.append(shared)
        columns.append(Column(**{**vars(column), "abscissa": shared.name}))
    return tuple(columns)


MEASURED_FILES.register(
    MeasuredFileFormat(
        name="uff",
        holds="a universal file (.uff, .unv)",
        suffixes=(".uff", ".unv", ".ufb", ".bunv"),
        recognise=recognise,
        read=read,
    )
)
