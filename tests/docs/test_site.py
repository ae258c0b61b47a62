"""The documentation becomes a site without a warning, and its pages load nothing from elsewhere."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
#: What a page loads: scripts, style sheets, pictures, fonts. A link that a reader may follow is none of it.
LOADED = re.compile(r"""<(?:script|img|iframe|source)[^>]*\ssrc=["'](?:https?:)?//|<link[^>]*href=["'](?:https?:)?//""")
FROM_STYLE = re.compile(r"""url\(["']?(?:https?:)?//|@import""")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if importlib.util.find_spec("sphinx_gallery") is None:
        pytest.skip('the packages of the site are not installed: pip install "stickslip[docs]"')
    out = tmp_path_factory.mktemp("docs") / "site"
    words = [sys.executable, str(ROOT / "docs" / "build.py"), "--examples", "none", "--out", str(out)]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=600)
    # Sphinx writes warnings, such as links that lead nowhere, to standard error.
    assert (done.returncode, done.stderr) == (0, "")
    return out


def test_every_page_of_the_repository_is_a_page_of_the_site(site: Path) -> None:
    pages = {path.relative_to(ROOT / "docs").with_suffix(".html") for path in (ROOT / "docs").rglob("*.md")}
    for page in pages - {Path("README.html")} | {
        Path("index.html"),
        Path("contributing.html"),
        Path("benchmarks.html"),
    }:
        assert (site / page).is_file(), page


def test_every_example_has_a_page_with_its_code(site: Path) -> None:
    for script in (ROOT / "examples").glob("*.py"):
        assert (site / "examples" / f"{script.stem}.html").is_file(), script.name


def test_every_public_name_is_described(site: Path) -> None:
    import stickslip

    shown = "".join(page.read_text(encoding="utf-8") for page in (site / "reference").glob("*.html"))
    for home in stickslip._HOME.values():
        assert f'id="{home.replace(":", ".")}"' in shown, home


def test_pages_load_nothing_from_elsewhere(site: Path) -> None:
    for page in site.rglob("*.html"):
        assert not LOADED.search(page.read_text(encoding="utf-8")), page
    for style in site.rglob("*.css"):
        assert not FROM_STYLE.search(style.read_text(encoding="utf-8")), style


def test_search_has_an_index_of_its_own(site: Path) -> None:
    index = (site / "searchindex.js").read_text(encoding="utf-8")
    assert "first_verdict" in index
    assert "craig" in index


def test_equations_are_drawn_by_the_browser(site: Path) -> None:
    page = (site / "harmonic_balance.html").read_text(encoding="utf-8")
    assert page.count("<math") > 20
    assert "MathJax" not in page
