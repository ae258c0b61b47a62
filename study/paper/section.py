"""A section of the page: sentences, tables and pictures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from study.compare.section.section import Table


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
    tables: Sequence[Table] = ()
    pictures: Mapping[str, bytes] = field(default_factory=dict)
