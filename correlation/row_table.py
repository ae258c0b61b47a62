"""Tables as frozen dataclasses: columns of one length, or tables of that length, as fields."""

from dataclasses import fields, replace
from typing import Any, Self

from jaxtyping import Bool, Int
from numpy.typing import NDArray


class RowTable:
    """A table of which some rows can be taken."""

    def __len__(self) -> int:
        """Number of rows [-]."""
        return len(getattr(self, fields(self)[0].name))  # type: ignore[arg-type]  # those that inherit are dataclasses

    def where(self, rows: Bool[NDArray[Any], " k"] | Int[NDArray[Any], " k"]) -> Self:
        """Table of some of the rows, by a mask or by their numbers."""
        columns = {each.name: getattr(self, each.name) for each in fields(self)}  # type: ignore[arg-type]
        taken = {
            name: column.where(rows) if isinstance(column, RowTable) else column[rows]
            for name, column in columns.items()
        }
        return replace(self, **taken)  # type: ignore[type-var]
