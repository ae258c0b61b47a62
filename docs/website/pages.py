"""Sources of the site: the Markdown pages of the repository, with links that lead to each other within the site.

A page stands in the repository as a Git host shows it. Its relative links are changed only where the site has the
target at another place. The groups of ``docs/README.md`` become the navigation.
"""

import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

#: A link or picture of Markdown: what stands before the target, the target, its anchor.
LINK = re.compile(r"(\]\()(?![a-z]+:|#)([^)\s#]+)(#[^)\s]*)?(?=\))")
#: Pages outside `docs/`, and where they are in the site.
OUTSIDE = {
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "benchmarks/README.md": "benchmarks.md",
}
START = "docs/README.md"


def site_pages(root: Path) -> dict[str, str]:
    """Every page of the repository that the site has: its file in the repository, and in the site."""
    pages = {path.relative_to(root).as_posix(): path for path in sorted((root / "docs").rglob("*.md"))}
    result = {name: path.relative_to(root / "docs").as_posix() for name, path in pages.items()}
    return result | OUTSIDE | {START: "index.md"}


def example_pages(root: Path) -> dict[str, str]:
    """Every example: its file in the repository, and its page in the site."""
    return {f"examples/{path.name}": f"examples/{path.stem}.rst" for path in sorted((root / "examples").glob("*.py"))}


def write_pages(root: Path, source: Path) -> None:
    """Write the pages with their links changed, and copy the files that they link to.

    Parameters
    ----------
    root
        The repository.
    source
        Folder of the sources of the site; created.

    Raises
    ------
    FileNotFoundError
        A link leads nowhere.
    """
    pages = site_pages(root)
    places = pages | example_pages(root) | {"README.md": "index.md", "examples": "examples/index.rst"}
    for name, place in pages.items():
        text = (root / name).read_text(encoding="utf-8")
        target = source / place
        target.parent.mkdir(parents=True, exist_ok=True)
        changed = _with_links(text, root, name, place, places, source)
        target.write_text(changed + (_navigation(changed) if name == START else ""), encoding="utf-8")


def _with_links(text: str, root: Path, name: str, place: str, places: dict[str, str], source: Path) -> str:
    def changed(link: re.Match[str]) -> str:
        target = os.path.normpath(Path(name).parent / link[2])
        if target not in places:
            if not (root / target).is_file():
                raise FileNotFoundError(f"{name}: the link {link[2]} leads to no file")
            copy = source / "files" / target
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(root / target, copy)
        there = os.path.relpath(places.get(target, f"files/{target}"), Path(place).parent)
        return f"{link[1]}{there}{link[3] or ''}"

    return LINK.sub(changed, text)


def _navigation(text: str) -> str:
    """One table of contents per heading of the first page, with the pages that are listed below it."""
    tables = []
    for heading, below in _sections(text):
        listed = [page.rpartition(".")[0] for page in re.findall(r"^- \[[^]]*\]\(([^)#]+)\)", below, re.MULTILINE)]
        if listed:
            tables += ["```{toctree}", ":hidden:", f":caption: {heading}", "", *listed, "```", ""]
    return "\n" + "\n".join(tables)


def _sections(text: str) -> Iterator[tuple[str, str]]:
    _, *pieces = re.split(r"^## (.+)$", text, flags=re.MULTILINE)
    yield from zip(pieces[::2], pieces[1::2], strict=True)
