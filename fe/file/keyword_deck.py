"""Keyword blocks of an Abaqus or CalculiX deck, with the files that it includes."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from fe.errors import MeshError


@dataclass(frozen=True, kw_only=True)
class KeywordBlock:
    """One keyword with its parameters, and the data lines that follow it.

    Parameters
    ----------
    keyword
        In capitals, such as "SOLID SECTION".
    parameters
        Values by name, the name in capitals; an empty text for one without a value.
    lines
        Data lines; those of a file that the parameter INPUT names come first.
    """

    keyword: str
    parameters: dict[str, str]
    lines: list[str] = field(default_factory=list)

    def entries(self) -> list[str]:
        """All comma-separated entries of the data lines; continuation lines end or begin with a comma."""
        return [entry for line in self.lines for entry in map(str.strip, line.split(",")) if entry]


def read_keyword_blocks(path: Path) -> Iterator[KeywordBlock]:
    """Blocks of a deck in their order.

    A keyword line that ends in a comma goes on in the next line. The lines of an included file stand in the place of
    its `*INCLUDE`, keywords and data alike.

    Raises
    ------
    MeshError
        A file that is named and not there, or that includes itself.
    """
    block = None
    for line in _join_keywords(_read_lines(path, path, ())):
        if line.startswith("*"):
            if block is not None:
                yield _with_input(path, block)
            block = _begin_block(line)
        elif block is not None:
            block.lines.append(line)
    if block is not None:
        yield _with_input(path, block)


def _join_keywords(lines: Iterator[str]) -> Iterator[str]:
    """Data lines as they are, and each keyword in one line."""
    keyword = ""
    for line in lines:
        if keyword and (line.startswith("*") or _is_data(line)):  # the comma was one too many
            yield keyword
            keyword = ""
        text = keyword + line
        keyword = text if text.startswith("*") and text.endswith(",") else ""
        if not keyword:
            yield text
    if keyword:
        yield keyword


def _read_lines(path: Path, deck: Path, outer: tuple[Path, ...]) -> Iterator[str]:
    """Lines without blanks around them, comments and empty ones left out, includes replaced by what they name."""
    if path in outer:
        raise MeshError(f"mesh file {path} includes itself: remove that *INCLUDE")
    with path.open("rb") as lines:
        for raw in lines:
            line = _decode(raw).strip()
            if not line or line.startswith("**"):
                continue
            if line[:8].upper() == "*INCLUDE":
                yield from _read_lines(
                    _find_file(path, deck, _begin_block(line).parameters.get("INPUT", "")), deck, (*outer, path)
                )
            else:
                yield line


def _decode(raw: bytes) -> str:
    """Names may have letters beyond ASCII, in the coding of the system that wrote them."""
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def _is_data(line: str) -> bool:
    return line[0] in "+-." or line[0].isdigit()


def _begin_block(line: str) -> KeywordBlock:
    keyword, *parameters = line[1:].split(",")
    pairs = (parameter.partition("=") for parameter in parameters if parameter.strip())
    return KeywordBlock(
        keyword=" ".join(keyword.upper().split()),
        parameters={key.strip().upper(): value.strip().strip('"') for key, _, value in pairs},
    )


def _with_input(path: Path, block: KeywordBlock) -> KeywordBlock:
    """The block with the data lines of the file that it names; such files hold no keywords."""
    name = block.parameters.get("INPUT")
    if name is None or block.keyword not in {"NODE", "ELEMENT", "NSET", "ELSET", "SURFACE", "ELASTIC", "DENSITY"}:
        return block
    file = _find_file(path, path, name)
    return KeywordBlock(
        keyword=block.keyword, parameters=block.parameters, lines=[*_read_lines(file, path, (path,)), *block.lines]
    )


def _find_file(path: Path, deck: Path, name: str) -> Path:
    """The file that a deck names, beside the file that names it or, as those programs look for it, beside the deck."""
    for folder in (path.parent, deck.parent):
        if name and (folder / name).is_file():
            return folder / name
    raise MeshError(f'mesh file {path} includes "{name}", which is not in the same folder: put it there')
