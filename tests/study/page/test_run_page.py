"""A command that draws figures writes a page that holds its answer, all of them, and what it was made by."""

import base64
import re
from io import BytesIO
from pathlib import Path

import pytest
from PIL import Image

from study.page.run_page import add_run_page
from study.run_context import Answer


@pytest.fixture
def pictures(tmp_path: Path) -> list[Path]:
    files = [
        tmp_path / name for name in ("two_masses_response.png", "two_masses_contact_states.png", "two_masses_mode2.gif")
    ]
    for number, file in enumerate(files):
        Image.new("RGB", (2, 2 + number)).save(file)
    return files


def test_the_page_holds_the_answer_and_every_picture(pictures: list[Path]) -> None:
    answer = Answer(document={"n": 1, "files": ["a.csv"]}, text="amplitude [um]  <b> & more\n\na.csv")
    told = add_run_page(answer, "solve", pictures)
    page = pictures[0].with_name("two_masses_solve.html")
    assert told.document == {"n": 1, "files": ["a.csv", str(page)]}
    assert isinstance(told.text, str)
    assert told.text.startswith("amplitude [um]  <b> & more\n")
    assert str(page) in told.text
    html = page.read_text(encoding="utf-8")
    assert "amplitude [µm]  &lt;b&gt; &amp; more" in html
    assert "a.csv" not in html
    assert re.findall(r"<h2>(.*?)</h2>", html) == ["Result", "Response", "Contact states", "Mode 2 film"]
    held = re.findall(r'src="data:image/(\w+);base64,(.*?)"', html)
    assert [kind for kind, _ in held] == ["png", "png", "gif"]
    assert [Image.open(BytesIO(base64.b64decode(data))).height for _, data in held] == [2, 3, 4]


def test_a_command_with_a_page_of_its_own_needs_no_other(pictures: list[Path]) -> None:
    answer = Answer(document={"files": ["own.html"]}, text="done")
    assert add_run_page(answer, "compare", pictures) is answer
    assert not list(pictures[0].parent.glob("*.html"))


def test_the_name_of_a_command_stands_once_in_the_name_of_its_page(pictures: list[Path]) -> None:
    drawn = [file.rename(file.with_name(f"chain_modes_{number}.png")) for number, file in enumerate(pictures)]
    told = add_run_page(Answer(document={}, text="done"), "modes", drawn)
    page = pictures[0].with_name("chain_modes.html")
    assert told.document["files"] == [str(page)]
    assert "<title>Chain</title>" in page.read_text(encoding="utf-8")
