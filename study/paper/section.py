"""A section of the page: sentences, tables and pictures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field


@dataclass(frozen=True, kw_only=True)
class PageTable:
    """A table.

    Parameters
    ----------
    head, rows
        Cells, as they are shown.
    words
        Columns at the left that hold words.
    """

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    words: int = 1


@dataclass(frozen=True, kw_only=True)
class PageSection:
    """A section.

    Parameters
    ----------
    title
        Heading.
    text
        Paragraphs.
    tables
        Tables below them.
    pictures
        PNG by caption.
    """

    title: str
    text: Sequence[str] = ()
    tables: Sequence[PageTable] = ()
    pictures: Mapping[str, bytes] = field(default_factory=dict)
