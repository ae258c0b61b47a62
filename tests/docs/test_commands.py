"""Every command line that the documentation shows is one that the program takes."""

import re
import shlex
from pathlib import Path

import pytest
from cyclopts import CycloptsError

from study.cli import make_command_line

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
#: Words that stand for what the reader puts there.
PLACEHOLDERS = {"COMMAND", "[OPTIONS]", "..."}


def command_lines(page: Path) -> list[str]:
    """Lines of code blocks that call stickslip, without comments."""
    text = page.read_text(encoding="utf-8")
    blocks = re.findall(r"^```(?:sh)?\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    blocks += re.findall(r"(?:^ {4}.*\n)+", text, re.MULTILINE)
    lines = [line.strip() for block in blocks for line in block.splitlines()]
    return [line for line in lines if re.match(r"(?:\.venv/bin/)?stickslip ", line)]


@pytest.mark.parametrize("page", [page for page in PAGES if command_lines(page)], ids=lambda page: page.name)
def test_the_program_takes_every_command_line(page: Path) -> None:
    for line in command_lines(page):
        _, *words = shlex.split(line, comments=True)
        if PLACEHOLDERS & set(words) or "--help" in words:
            continue
        try:
            _, bound, unused, _ = make_command_line().parse_known_args(words)
        except CycloptsError as error:
            pytest.fail(f"{page.name}: {line}: {error}")
        assert not unused, line
        assert bound is not None
