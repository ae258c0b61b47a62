"""Degrees of freedom of the rows of an imported matrix: node and direction, and the files with them."""

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Int
from numpy.typing import NDArray

from fe.errors import MatrixFileError
from geometry.read_only_array import freeze_fields

#: Directions by number; the last three are rotations.
DIRECTIONS = ("x", "y", "z", "rotx", "roty", "rotz")
N_TRANSLATION = 3
#: Largest node label: programs number nodes in 32 bits; keys of node and direction then fit into 64.
LARGEST_LABEL = 2**31 - 1
#: Characters of an entry that cannot be read, in a message.
SHOWN_CHARACTERS = 40

_NUMBER = {name: number for number, name in enumerate(DIRECTIONS)}
#: Other names of directions: those of ANSYS, and Nastran's component numbers.
_NUMBER |= {"ux": 0, "uy": 1, "uz": 2, "rx": 3, "ry": 4, "rz": 5} | {str(number + 1): number for number in range(6)}
_MAPPING = re.compile(r"\s*(\d+)\s+(\d+)\s+([A-Za-z]+)\b")

Rows = Int[NDArray[np.int64], " n"]


@dataclass(frozen=True, kw_only=True, eq=False)
class DofLabels:
    """Node and direction of each row of a matrix; arrays are copied and read-only.

    Parameters
    ----------
    node
        Node labels in the program that wrote the matrix, shape (n,) [-].
    direction
        Directions: 0 to 2 for x, y, z, and 3 to 5 for the rotations about them, shape (n,) [-].

    Raises
    ------
    MatrixFileError
        A label outside 0 to `LARGEST_LABEL`, or two rows with the same degree of freedom.
    """

    node: Rows
    direction: Rows

    def __post_init__(self) -> None:
        given = np.asarray(self.node)  # an object array if a label exceeds 64 bits
        outside = np.flatnonzero((given < 0) | (given > LARGEST_LABEL))
        if len(outside):
            raise MatrixFileError(
                f"the row {outside[0]} belongs to node {int(given[outside[0]])}, but nodes are 0 to {LARGEST_LABEL}: "
                "renumber the nodes"
            )
        freeze_fields(self, "node", "direction", kind=np.int64)
        order = np.argsort(self.key, kind="stable")
        twice = np.flatnonzero(np.diff(self.key[order]) == 0)
        if len(twice):
            first, second = sorted(order[twice[0] : twice[0] + 2])
            raise MatrixFileError(
                f"the rows {first} and {second} both belong to {self.name(int(first))}: give each row a different "
                "degree of freedom"
            )

    @property
    def n_dof(self) -> int:
        """Number of rows n [-]."""
        return len(self.node)

    @property
    def key(self) -> Rows:
        """One number for each degree of freedom, ascending by node, then direction, shape (n,) [-]."""
        return len(DIRECTIONS) * self.node + self.direction

    def name(self, row: int) -> str:
        """Name of a row, such as "node 12 rotx"."""
        return f"node {self.node[row]} {DIRECTIONS[self.direction[row]]}"

    def rows(self, nodes: Sequence[int], directions: Sequence[int]) -> Rows:
        """Rows of nodes in directions, nodes outermost; directions that a node lacks are skipped.

        Raises
        ------
        MatrixFileError
            A node that has no row in any of these directions.
        """
        order = np.argsort(self.key)
        result = []
        for node in nodes:
            wanted = len(DIRECTIONS) * node + np.asarray(directions)
            place = np.searchsorted(self.key, wanted, sorter=order).clip(max=self.n_dof - 1)
            rows = order[place][self.key[order[place]] == wanted]
            if not len(rows):
                own = [DIRECTIONS[item] for item in np.sort(self.direction[self.node == node])]
                has = f"it has {', '.join(own)}" if own else "no row belongs to it"
                wished = ", ".join(DIRECTIONS[item] for item in directions)
                remedy = "name other directions" if own else "name a node of the model, or correct its table of rows"
                raise MatrixFileError(f"node {node} has no degree of freedom {wished}: {has}, so {remedy}")
            result.append(rows)
        return np.concatenate([np.zeros(0, dtype=np.int64), *result])


def numbered(n_dof: int) -> DofLabels:
    """Default for a missing table: row k is node k in direction x."""
    return DofLabels(node=np.arange(n_dof), direction=np.zeros(n_dof, dtype=np.int64))


def find_direction_number(name: str) -> int:
    """Number of a direction from its name: 0 for x, UX or 1; 3 for rotx or 4.

    Raises
    ------
    MatrixFileError
        An unknown name.
    """
    number = _NUMBER.get(name.strip().lower())
    if number is None:
        raise MatrixFileError(f'"{name.strip()}" is not a direction: it must be one of {", ".join(DIRECTIONS)}')
    return number


def read_dof_table(path: Path | str) -> DofLabels:
    """Read the degree of freedom of each row.

    Parameters
    ----------
    path
        ``.csv`` with the columns ``dof, node, direction``, dof counted from 0 in any order; the ``.mapping`` file of
        ANSYS' HBMAT: equation, node and label (UX ... ROTZ) in each line; or the ``.dof`` file of CalculiX:
        node.direction in each line.

    Raises
    ------
    MatrixFileError
        A missing file, another kind of file, missing columns or rows, a row or degree of freedom that occurs twice, or
        an entry that is not a number or direction.
    """
    path = Path(path)
    if not path.is_file():
        raise MatrixFileError(f'there is no file "{path}": check its name and folder')
    kind = path.suffix.lower()
    reader = {".csv": _read_csv, ".mapping": _read_mapping, ".dof": _read_node_dot_direction}.get(kind)
    if reader is None:
        raise MatrixFileError(f'"{path}" ends in "{path.suffix}": give degrees of freedom as .csv, .mapping or .dof')
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise MatrixFileError(
            f'"{path}" is not a text file: give degrees of freedom as .csv, .mapping or .dof'
        ) from None
    result = reader(path, lines)
    rows = [row for row, _, _ in result]
    if sorted(rows) != list(range(len(rows))):
        counted = sorted(rows)
        if counted == list(range(1, len(rows) + 1)):
            raise MatrixFileError(f'"{path}" counts its rows from 1: count them from 0')
        first = next((k for k, row in enumerate(counted) if row != k), len(rows))
        what = "twice" if first and counted[first - 1] == counted[first] else "without a row of that number before it"
        raise MatrixFileError(f'"{path}" has the row {counted[first]} {what}: number the rows without gaps')
    ordered = sorted(result)
    try:
        return DofLabels(node=np.array([n for _, n, _ in ordered]), direction=np.array([d for _, _, d in ordered]))
    except MatrixFileError as error:
        raise MatrixFileError(f'"{path}": {error}') from None


def _read_csv(path: Path, lines: list[str]) -> list[tuple[int, int, int]]:
    try:
        return _read_entries(path, lines)
    except csv.Error as error:
        raise MatrixFileError(f'"{path}" is not a table ({error}): give columns of dof, node and direction') from None


def _read_entries(path: Path, lines: list[str]) -> list[tuple[int, int, int]]:
    # Spreadsheets separate columns by semicolons where the comma is the decimal separator.
    reader = csv.DictReader(lines, skipinitialspace=True, delimiter=";" if lines and ";" in lines[0] else ",")
    names = [name.strip().lower() for name in reader.fieldnames or ()]
    missing = {"dof", "node", "direction"} - set(names)
    if missing:
        raise MatrixFileError(
            f'"{path}" has no column {sorted(missing)[0]}, it has {", ".join(names) or "none"}: its first line must '
            "name dof, node and direction"
        )
    reader.fieldnames = names
    result = []
    for entry in reader:
        try:
            result.append((int(entry["dof"]), int(entry["node"]), find_direction_number(entry["direction"] or "")))
        except (ValueError, TypeError) as error:
            why = f": {error}" if isinstance(error, MatrixFileError) else ": give whole numbers"
            shown = ", ".join(str(entry[name])[:SHOWN_CHARACTERS] for name in ("dof", "node", "direction"))
            raise MatrixFileError(f'"{path}", line {reader.line_num}: cannot read "{shown}"{why}') from None
    if not result:
        raise MatrixFileError(f'"{path}" lists no row: give one line for each row of the matrices')
    return result


def _read_mapping(path: Path, lines: list[str]) -> list[tuple[int, int, int]]:
    result = []
    for number, line in enumerate(lines, start=1):
        match = _MAPPING.match(line)
        if match is None:
            continue  # headings
        equation, node, label = match.groups()
        try:
            result.append((int(equation) - 1, int(node), find_direction_number(label)))
        except MatrixFileError as error:
            raise MatrixFileError(f'"{path}", line {number}: {error}; remove other fields from the model') from None
        except ValueError:  # int() refuses numbers of thousands of digits
            raise MatrixFileError(
                f'"{path}", line {number}: cannot read "{line.strip()[:SHOWN_CHARACTERS]}": '
                "give equation, node and label"
            ) from None
    if not result:
        raise MatrixFileError(f'"{path}" lists no equation: write it with HBMAT, its last field YES')
    return result


def _read_node_dot_direction(path: Path, lines: list[str]) -> list[tuple[int, int, int]]:
    result: list[tuple[int, int, int]] = []
    for number, line in enumerate(lines, start=1):
        # Read as text: 12.1 and 12.10 would be the same number.
        node, dot, direction = line.strip().partition(".")
        try:
            result.append((len(result), int(node), find_direction_number(direction if dot else "")))
        except ValueError:
            raise MatrixFileError(
                f'"{path}", line {number}: cannot read "{line.strip()[:SHOWN_CHARACTERS]}": give node.direction'
            ) from None
    if not result:
        raise MatrixFileError(f'"{path}" lists no row: write it with *FREQUENCY, SOLVER=MATRIXSTORAGE')
    return result
