"""Split degrees of freedom into the boundary, which is retained, and the interior, which is condensed."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

from fe.sparse.factor import Symmetric
from fe.sparse.node_matrix import NodeMatrix
from fe.sparse.symmetric_part import PartView, find_whole_nodes, part
from fe.system import LinearSystem
from reduction.array_type import Whole
from reduction.errors import RomError

Rows = Int[Whole, " k"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Partition:
    """Boundary and interior rows of a linear system."""

    boundary: Rows
    """Retained rows of the system, in the order of their first occurrence in the boundary sets, shape (b,) [-]."""
    interior: Rows
    """All other rows, ascending, shape (i,) [-]."""
    boundary_sets: Mapping[str, Rows]
    """Indices in `boundary` by set name, each of shape (k,) [-]; these are the rows of the reduced model."""


def partition(system: LinearSystem, boundary: Mapping[str, Rows]) -> Partition:
    """Split the rows of a system; a degree of freedom in several sets is retained once.

    Raises
    ------
    RomError
        A set without rows, or with a row that the supports fix (-1) or that does not exist.
    """
    for name, rows in boundary.items():
        _check(name, np.asarray(rows), system.n_dof)
    named = np.concatenate([np.zeros(0, dtype=np.int64), *(np.asarray(rows).ravel() for rows in boundary.values())])
    _, first = np.unique(named, return_index=True)
    retained = named[np.sort(first)]
    place = np.full(system.n_dof, -1)
    place[retained] = np.arange(len(retained))
    return Partition(
        boundary=retained,
        interior=np.flatnonzero(place < 0),
        boundary_sets={name: place[np.asarray(rows).ravel()] for name, rows in boundary.items()},
    )


def take_interior_part(matrix: Symmetric, rows: Rows) -> Symmetric:
    """Interior part of a matrix; it is copied only if it is small, as for a `NodeMatrix`."""
    if isinstance(matrix, NodeMatrix) and find_whole_nodes(rows) is not None:
        return part(matrix, rows)
    return PartView(matrix=matrix, rows=rows)


def _check(name: str, rows: Rows, n_dof: int) -> None:
    if not rows.size:
        raise RomError(f'boundary set "{name}" is empty: give it at least one degree of freedom, or remove it')
    fixed = np.flatnonzero(rows.ravel() == -1)
    if fixed.size:
        raise RomError(
            f'boundary set "{name}" names {fixed.size} of {rows.size} degrees of freedom that the supports fix '
            f"(first: entry {fixed[0]}): remove them from the set or from the support"
        )
    if rows.min() < 0 or rows.max() >= n_dof:
        wrong = rows.max() if rows.max() >= n_dof else rows.min()
        raise RomError(f'boundary set "{name}" names row {wrong}: the system has rows 0 to {n_dof - 1}')
