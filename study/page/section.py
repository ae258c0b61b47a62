"""Section of a plain page: sentences, tables and pictures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from study.page.table import Table


@dataclass(frozen=True, kw_only=True)
class PageSection:
    """Section of a page.

    Parameters
    ----------
    title
        Heading.
    text
        Paragraphs.
    report
        Text in lines and columns, as a command prints it.
    tables
        Tables.
    pictures
        Bytes of PNG or GIF files by caption.
    """

    title: str
    text: Sequence[str] = ()
    report: str = ""
    tables: Sequence[Table] = ()
    pictures: Mapping[str, bytes] = field(default_factory=dict)
