"""Page of a command that draws figures but writes no page itself: its answer, its figures and its provenance."""

import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import takewhile
from pathlib import Path

from pipeline.output import replace_file
from study.page.plain_page import render_plain_page
from study.page.section import PageSection
from study.run_context import Answer

#: Largest height of a picture, as a CSS length; it fits on most screens.
TALLEST = "46rem"
#: Separator of the words in a file name.
BETWEEN = "_"


def add_run_page(answer: Answer, command: str, pictures: Sequence[Path]) -> Answer:
    """Write the page of a run into the folder of its pictures, and add its name to the answer.

    Parameters
    ----------
    answer
        Answer of the command, in plain text.
    command
        Name of the command.
    pictures
        Files of its pictures, all in one folder.

    Returns
    -------
    Answer with the name of the page; the unchanged answer if the command wrote a page itself.
    """
    files = answer.document.get("files", ())
    if any(Path(file).suffix == ".html" for file in files):
        return answer
    text, names = str(answer.text), [file.stem.split(BETWEEN) for file in pictures]
    # The last word of a file name describes the picture, so that it does not count as common.
    starts = zip(*(name[:-1] for name in names), strict=False)
    common = [item[0] for item in takewhile(lambda item: len(set(item)) == 1, starts)]
    sections = [
        PageSection(
            title=_format_heading([*name[len(common) :], *(["film"] if file.suffix == ".gif" else [])]),
            pictures={file.name: file.read_bytes()},
        )
        for name, file in zip(names, pictures, strict=True)
    ]
    # If the common words end with the name of the command, it is left out of the title.
    own = common[:-1] if common[1:] and common[-1] == command else common
    page = pictures[0].with_name(f"{BETWEEN.join([*own, command])}.html")
    # Lines with file names are left out of the page.
    lines = [line for line in text.splitlines() if line.strip() not in {str(file) for file in files}]
    sections.insert(0, PageSection(title="Result", report="\n".join(lines).rstrip()))
    html = render_plain_page(
        title=_format_heading(own), over=f"stickslip {command}", sections=sections, tallest=TALLEST
    )
    replace_file(page, html)
    return replace(
        answer,
        document={**answer.document, "files": [*files, str(page)]},
        text=f"{text}\n\nThe page with all figures: {page}",
    )


def _format_heading(words: Sequence[str]) -> str:
    """Heading from the words of a file name; "mode1" becomes "Mode 1"."""
    text = re.sub(r"(?<=[a-z])(?=\d)", " ", " ".join(words))
    return text[:1].upper() + text[1:]
