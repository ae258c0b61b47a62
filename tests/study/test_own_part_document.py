"""What docs/own_part.md shows is what the example in the repository is and gives."""

import re
import textwrap
from pathlib import Path

from geometry.step_part import step_part
from study.kind.part.reduce_report import format_face_lines
from study.kind.part.stages import NamedFaces
from study.kind.registry import open_case

ROOT = Path(__file__).parents[2]
DOCUMENT = (ROOT / "docs" / "own_part.md").read_text(encoding="utf-8")
CASE = ROOT / "examples" / "parts" / "screw.toml"


def blocks() -> list[str]:
    """Indented blocks, without their indent."""
    return [textwrap.dedent(item) for item in re.findall(r"(?:^ {4}.*\n|^\n(?= {4}))+", DOCUMENT, re.MULTILINE)]


def test_the_case_is_the_example_word_for_word() -> None:
    assert CASE.read_text(encoding="utf-8") in [block.lstrip("\n") for block in blocks()]


def test_the_table_of_faces_is_that_of_the_example() -> None:
    case = open_case(CASE).case.structure
    part = step_part(CASE.parent / case.file, {face.name: [face.selector()] for face in case.face})
    faces = {
        name: NamedFaces(n_face=len(region.faces), area=region.area, centre=region.centre)
        for name, region in part.faces.items()
    }
    table = textwrap.dedent("\n".join([*format_face_lines(faces), ""]))
    assert table in [block.lstrip("\n") for block in blocks()]
