"""A page of sentences, tables and pictures, in one file that loads nothing."""

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
        What follows.
    tone, tag, verdict
        Colour and words of the box on top, and the sentences in it; no box without a tag.
    tallest
        Largest height of a picture, as a length of CSS.
    """
    return fill_template(
        TEMPLATE, {}, {"embed": embed},
        title=title, over=over, tone=tone, tag=tag, verdict=verdict, sections=sections, tallest=tallest,
    )  # fmt: skip
