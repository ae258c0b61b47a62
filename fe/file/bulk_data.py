"""Cards of Nastran bulk data, in fields of 8 or 16 characters or separated by commas.

A card continues in lines that begin with a blank, a comma, "+" or "*"; a line has eight data fields, or four of 16
characters.

References
----------
MSC Nastran Quick Reference Guide, Format of Bulk Data Entries; INCLUDE.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from fe.errors import MeshError

#: Number of characters of a usual field, and of a line's name and data fields together.
FIELD, WIDTH = 8, 72
#: Sections before the bulk data.
EXECUTIVE = re.compile(r"\s*(SOL\s+\S|CEND\b)", re.IGNORECASE)


@dataclass(frozen=True, kw_only=True)
class BulkCard:
    """Card of bulk data.

    Parameters
    ----------
    name
        Name in capitals, without the star of wide fields.
    fields
        Data fields; blank fields are empty texts, trailing blank fields are removed.
    """

    name: str
    fields: list[str]

    def field(self, place: int) -> str:
        """Text of a field, empty after the last one."""
        return self.fields[place] if place < len(self.fields) else ""


def read_bulk_cards(path: Path) -> Iterator[BulkCard]:
    """Cards between "BEGIN BULK" and "ENDDATA", or of a file without other sections, with those of included files.

    Raises
    ------
    MeshError
        A file with sections but without these lines, or an included file that does not exist or includes itself.
    """
    lines = _read_lines(path)
    begin = next((k for k, line in enumerate(lines) if line.strip().upper().startswith("BEGIN BULK")), None)
    if begin is None and any(EXECUTIVE.match(line) for line in lines):
        raise MeshError(f'mesh file {path} has no line "BEGIN BULK": write it with one, and with ENDDATA at its end')
    if begin is not None and not any(_is_end(line) for line in lines[begin:]):
        raise MeshError(f'mesh file {path} has no line "ENDDATA" after "BEGIN BULK": it is truncated, write it again')
    name, fields = "", list[str]()
    for line in _expand_includes(path, lines[0 if begin is None else begin + 1 :], (path,)):
        data = _split_data(line)
        if name and line[0] in " +*,":
            fields += data
            continue
        if name:
            yield _make_card(name, fields)
        name, fields = line.split(",")[0][:FIELD].strip().rstrip("*").upper(), data
    if name:
        yield _make_card(name, fields)


def _make_card(name: str, fields: list[str]) -> BulkCard:
    last = max((k for k, field in enumerate(fields, start=1) if field), default=0)
    return BulkCard(name=name, fields=fields[:last])


def _read_lines(path: Path) -> list[str]:
    return path.read_text(encoding="latin-1").splitlines()


def _is_end(line: str) -> bool:
    return line.strip().upper().startswith("ENDDATA")


def _expand_includes(path: Path, lines: list[str], outer: tuple[Path, ...]) -> Iterator[str]:
    """Lines of cards without comments; each INCLUDE is replaced by the lines of its file."""
    remaining = iter(lines)
    for raw in remaining:
        line = raw.split("$")[0].rstrip()
        if _is_end(line):
            return
        if line[:FIELD].upper().rstrip() != "INCLUDE":
            if line:
                yield line
            continue
        name = raw[FIELD - 1 :].strip()
        while name[:1] in {"'", '"'} and name.count(name[0]) < 2:  # a long name continues in the next line
            name += next(remaining, name[0]).strip()
        file = path.parent / name.strip("'\" ")
        if not file.is_file():
            raise MeshError(f'mesh file {path} includes "{name}", which is not in the same folder: put it there')
        if file in outer:
            raise MeshError(f"mesh file {file} includes itself: remove that INCLUDE")
        yield from _expand_includes(file, _read_lines(file), (*outer, file))


def _split_data(line: str) -> list[str]:
    """Data fields of one line, filled up with empty texts to the full number."""
    if "," in line:
        head, *fields = (field.strip() for field in line.split(","))
        count = 4 if "*" in head else 8
    else:
        line = line.expandtabs(FIELD)
        width = 2 * FIELD if "*" in line[:FIELD] else FIELD
        count = (WIDTH - FIELD) // width
        fields = [line[k : k + width].strip() for k in range(FIELD, min(len(line), WIDTH), width)]
    return (fields + [""] * count)[:count]
