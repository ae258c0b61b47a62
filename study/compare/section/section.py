"""Section of the page of a comparison."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from study.page.table import Table


@dataclass(frozen=True, kw_only=True)
class Section:
    """A section of the page.

    Parameters
    ----------
    title
        Heading.
    text
        Sentences below the heading that explain the drawings.
    table
        Rows of numbers.
    pictures
        PNG files by their captions.
    plots
        Plotly figures, ``{"data": ..., "layout": ...}``, one below the other.
    html
        Further HTML, which must not load anything.
    element
        Name of a drawing of the page's script, such as "responses".
    data
        Data of that drawing.
    """

    title: str
    text: str = ""
    table: Table | None = None
    pictures: Mapping[str, bytes] = field(default_factory=dict)
    plots: Sequence[Mapping[str, Any]] = ()
    html: str = ""
    element: str = ""
    data: Mapping[str, Any] = field(default_factory=dict)
