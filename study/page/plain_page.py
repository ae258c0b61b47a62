"""Self-contained page of sentences, tables and pictures."""

from collections.abc import Sequence
from pathlib import Path

from study.page.html import embed, fill_template
from study.page.section import PageSection

TEMPLATE = Path(__file__).with_name("plain_page.html.j2")


def render_plain_page(
    *,
    title: str,
    over: str,
    sections: Sequence[PageSection],
    tone: str = "",
    tag: str = "",
    verdict: Sequence[str] = (),
    tallest: str = "none",
) -> str:
    """HTML of a page.

    Parameters
    ----------
    title, over
        Heading, and the line above it.
    sections
        Sections of the page.
    tone, tag, verdict
        Colour, label and sentences of the box at the top; no box without a tag.
    tallest
        Largest height of a picture, as a CSS length.
    """
    return fill_template(
        TEMPLATE, {}, {"embed": embed},
        title=title, over=over, tone=tone, tag=tag, verdict=verdict, sections=sections, tallest=tallest,
    )  # fmt: skip
