"""A figure from outside, in one file, appears in the output folder of every command that has a result of its kind."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from PIL import Image

from figure.registry import REGISTRY
from study.cli import main
from study.shipped_cases import SOLVE

NYQUIST = Path(__file__).with_name("nyquist_figure.py")


@pytest.fixture
def clean_registry() -> Iterator[None]:
    """The other tests of this process do without it."""
    yield
    REGISTRY.forget(NYQUIST)


@pytest.mark.usefixtures("clean_registry")
def test_solve_draws_it_beside_its_own_figures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, cache = tmp_path / "out", tmp_path / "cache"
    words = [str(SOLVE), "--out", str(out), "--cache", str(cache), "--quiet"]
    assert main(["solve", *words, "--figures", str(NYQUIST)]) == 0
    drawn = sorted(file.name for file in out.glob("*_response*.png"))
    own = [name for name in drawn if "nyquist" not in name]
    assert own
    assert [name.replace(".png", "_nyquist.png") for name in own] == [name for name in drawn if "nyquist" in name]
    told = capsys.readouterr().out
    for name in drawn:
        assert name in told
        with Image.open(out / name) as picture:
            picture.verify()


def test_a_file_without_a_figure_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "nothing.py"
    file.write_text("x = 1\n")
    assert main(["solve", str(SOLVE), "--out", str(tmp_path / "out"), "--figures", str(file)]) == 2
    said = capsys.readouterr().err
    assert "nothing.py" in said
    assert "figure" in said
    REGISTRY.forget(file)
