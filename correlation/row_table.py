"""Tables as frozen dataclasses: columns of one length, or tables of that length, as fields."""

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any, Self, TypeVar

import numpy as np
from jaxtyping import Bool, Int
from numpy.typing import NDArray


class RowTable:
    """A table of which some rows can be taken."""

    def __len__(self) -> int:
        """Number of rows [-]."""
        return len(getattr(self, fields(self)[0].name))  # type: ignore[arg-type]  # those that inherit are dataclasses

    def where(self, rows: Bool[NDArray[Any], " k"] | Int[NDArray[Any], " k"]) -> Self:
        """Table of some of the rows, by a mask or by their numbers."""
        columns = {item.name: getattr(self, item.name) for item in fields(self)}  # type: ignore[arg-type]
        taken = {
            name: column.where(rows) if isinstance(column, RowTable) else column[rows]
            for name, column in columns.items()
        }
        return replace(self, **taken)  # type: ignore[type-var]


Table = TypeVar("Table", bound=RowTable)


def join_tables(tables: Sequence[Table]) -> Table:
    """The rows of several tables with the same columns, one table after the other."""
    columns: dict[str, Any] = {}
    for column in fields(tables[0]):  # type: ignore[arg-type]  # those that inherit are dataclasses
        parts = [getattr(table, column.name) for table in tables]
        columns[column.name] = join_tables(parts) if isinstance(parts[0], RowTable) else np.concatenate(parts)
    return replace(tables[0], **columns)  # type: ignore[type-var]
