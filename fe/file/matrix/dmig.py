"""Matrices on DMIG cards of Nastran punch files: each column names its grid point and component.

Fields are 8 characters wide, 16 on cards with an asterisk, or separated by commas::

    DMIG    KAAX    0       6       2       0                       4
    DMIG*   KAAX                           1               1
    *                      1               1 2.000000000D+04
    *                      2               1-1.000000000D+04

The first card is the heading: form (6 is symmetric, one triangle stored) and type (1 and 2 are real). A scalar point
has component 0 and counts as direction x.

References
----------
MSC Nastran Quick Reference Guide, DMIG.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fe.errors import MatrixFileError
from fe.file.dof_table import DofLabels
from fe.file.matrix import MATRIX_FORMATS
from fe.file.matrix_content import FileMatrix, read_fortran_real
from fe.file.registry import FileFormat

_SYMMETRIC, _REAL = 6, {1, 2}
#: Characters of a field, and of a line in a message.
_FIELD, _SHOWN = 8, 40

Dof = tuple[int, int]


@dataclass
class _Cards:
    """Form and entries of a matrix, collected from its cards."""

    form: int
    entries: dict[tuple[Dof, Dof], float] = field(default_factory=dict)


def read_dmig(path: Path) -> Mapping[str, FileMatrix]:
    """Read all square real matrices of a file, by name, on the degrees of freedom that their cards name.

    Raises
    ------
    MatrixFileError
        A file without DMIG cards, a complex or rectangular matrix, or a card that cannot be read.
    """
    result: dict[str, _Cards] = {}
    for number, fields in _read_cards(path):
        try:
            _take(path, result, fields)
        except (ValueError, LookupError) as error:
            if isinstance(error, MatrixFileError):
                raise
            raise MatrixFileError(
                f'"{path}", line {number}: the DMIG card of {fields[0] if fields else "no matrix"} cannot be read: '
                "give name, grid, component, and for each entry grid, component and value"
            ) from None
    if not result:
        raise MatrixFileError(f'"{path}" holds no DMIG card: write it with EXTSEOUT(DMIGPCH) or PARAM,EXTOUT,DMIGPCH')
    try:
        return {name: _make_matrix(cards) for name, cards in result.items()}
    except MatrixFileError as error:
        raise MatrixFileError(f'"{path}": {error}') from None


def _take(path: Path, cards: dict[str, _Cards], fields: list[str]) -> None:
    name = fields[0]
    if name not in cards:
        if int(fields[1]) != 0:
            raise MatrixFileError(f'"{path}": the DMIG cards of {name} have no heading: its first card has grid 0')
        form, kind = int(fields[2]), int(fields[3])
        if kind not in _REAL:
            raise MatrixFileError(f'"{path}": {name} is complex (type {kind}): give losses as a damping matrix')
        if form not in {1, _SYMMETRIC}:
            raise MatrixFileError(f'"{path}": {name} is of form {form}, which is not square: give form 1 or 6')
        cards[name] = _Cards(form=form)
        return
    column = _read_dof(fields[1], fields[2])
    # Field 5 is unused; entries follow in groups of grid, component, real and imaginary part.
    for start in range(4, len(fields), 4):
        group = fields[start : start + 4]
        if any(group):
            cards[name].entries[_read_dof(group[0], group[1]), column] = read_fortran_real(group[2])


def _read_dof(grid: str, component: str) -> Dof:
    direction = int(component or 0)
    if not 0 <= direction <= 6:
        raise ValueError(component)
    return int(grid), max(direction - 1, 0)


def _make_matrix(cards: _Cards) -> FileMatrix:
    dofs = sorted({dof for place in cards.entries for dof in place})
    place = {dof: number for number, dof in enumerate(dofs)}
    entries = cards.entries
    if cards.form == _SYMMETRIC:
        # Either of the two entries of a pair may have been written.
        entries = {(column, row): value for (row, column), value in entries.items()} | entries
    rows = [place[row] for row, _ in entries]
    cols = [place[column] for _, column in entries]
    values = np.array(list(entries.values()), dtype=np.float64)
    matrix = sp.csr_array(sp.coo_array((values, (rows, cols)), shape=(len(dofs),) * 2))
    table = DofLabels(node=np.array([node for node, _ in dofs]), direction=np.array([item for _, item in dofs]))
    return FileMatrix(matrix=matrix, dofs=table)


def _read_cards(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Line and fields of each DMIG card, continuations included, without the word DMIG."""
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise MatrixFileError(f'"{path}" cannot be read ({error.strerror}): check its permissions') from None
    card: list[str] = []
    first = 0
    for number, line in enumerate(lines, start=1):
        text = line.partition("$")[0].rstrip().expandtabs(_FIELD)
        if not text:
            continue
        if text.upper().startswith("DMIG") and text[4:5] in {"", " ", "*", ","}:
            if card:
                yield first, card
            card, first = _split_fields(text), number
        elif card and text[0] in "*+ ,":
            card += _split_fields(text)
        elif card and not text[0].isalpha():
            raise MatrixFileError(
                f'"{path}", line {number}: "{text[:_SHOWN]}" is neither a card nor the continuation of one: start '
                "continuations with a blank, a comma, + or *"
            )
        else:
            if card:
                yield first, card
            card = []
    if card:
        yield first, card


def _split_fields(text: str) -> list[str]:
    """Data fields of one line: eight of the usual width, or four of double width."""
    if "," in text:
        wide = "*" in text.partition(",")[0]
        fields = [item.strip() for item in text.split(",")][1:]
    else:
        wide = "*" in text[:_FIELD]
        width = 2 * _FIELD if wide else _FIELD
        data = text[_FIELD:72]
        fields = [data[start : start + width].strip() for start in range(0, len(data), width)]
    count = 4 if wide else 8
    return (fields + [""] * count)[:count]


MATRIX_FORMATS.register(
    FileFormat(
        name="dmig",
        suffixes=(".pch", ".bdf", ".dat"),
        recognise=lambda head: b"DMIG" in head.upper(),
        read=read_dmig,
        write=None,
    )
)
