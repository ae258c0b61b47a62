"""Docstrings and signatures of the product as Sphinx shows them: bars mean a size, and types have short names."""

import re
from typing import Any

from pygments.lexers.special import TextLexer

QUOTED = re.compile(r"(`+[^`]*`+)")
MODULE = re.compile(r"~(?:\w+\.)+")


def escape_bars(app: Any, what: str, name: str, value: object, options: object, lines: list[str]) -> None:
    """Escape the bars of a docstring outside of what is quoted."""
    del app, what, name, value, options
    for index, line in enumerate(lines):
        pieces = QUOTED.split(line)
        pieces[::2] = [piece.replace("|", r"\|") for piece in pieces[::2]]
        lines[index] = "".join(pieces)


def shorten_types(
    app: Any, what: str, name: str, value: object, options: object, signature: str | None, returned: str | None
) -> tuple[str | None, str | None]:
    """Leave the modules out of annotations that are no plain names, such as arrays with shapes."""
    del app, what, name, value, options
    shorter = [None if text is None else MODULE.sub("", text) for text in (signature, returned)]
    return shorter[0], shorter[1]


def setup(app: Any) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("autodoc-process-docstring", escape_bars)
    app.connect("autodoc-process-signature", shorten_types)
    app.add_lexer("csv", TextLexer)
    return {"parallel_read_safe": True}
