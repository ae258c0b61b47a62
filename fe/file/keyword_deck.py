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
        Keyword in capitals, such as "SOLID SECTION".
    parameters
        Values of the parameters by name, the name in capitals; an empty text for a parameter without a value.
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

    A keyword line that ends in a comma continues in the next line. The keyword and data lines of an included file
    replace its `*INCLUDE`.

    Raises
    ------
    MeshError
        An included file that does not exist, or that includes itself.
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
    """Lines of a deck with the continuation lines of each keyword joined."""
    keyword = ""
    for line in lines:
        if keyword and (line.startswith("*") or _is_data(line)):  # a comma at the end without a continuation line
            yield keyword
            keyword = ""
        text = keyword + line
        keyword = text if text.startswith("*") and text.endswith(",") else ""
        if not keyword:
            yield text
    if keyword:
        yield keyword


def _read_lines(path: Path, deck: Path, outer: tuple[Path, ...]) -> Iterator[str]:
    """Stripped lines without comments and empty lines; each include is replaced by the lines of its file."""
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
    """Text of a line: UTF-8, else Latin-1, for names with letters beyond ASCII."""
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
    """Block with the data lines of the file that its parameter INPUT names; such files contain no keywords."""
    name = block.parameters.get("INPUT")
    if name is None or block.keyword not in {"NODE", "ELEMENT", "NSET", "ELSET", "SURFACE", "ELASTIC", "DENSITY"}:
        return block
    file = _find_file(path, path, name)
    return KeywordBlock(
        keyword=block.keyword, parameters=block.parameters, lines=[*_read_lines(file, path, (path,)), *block.lines]
    )


def _find_file(path: Path, deck: Path, name: str) -> Path:
    """File that a deck includes: in the folder of the including file or, as Abaqus and CalculiX do, of the deck."""
    for folder in (path.parent, deck.parent):
        if name and (folder / name).is_file():
            return folder / name
    raise MeshError(f'mesh file {path} includes "{name}", which is not in the same folder: put it there')
