"""Pages of the public names from their docstrings, one page per section of ``docs/api.md``."""

import importlib
import inspect
import re
from pathlib import Path

ROW = re.compile(r"^\| `(\w+)` \|(.*)\| `([\w.]+)` \|$", re.MULTILINE)


def write_reference(root: Path, source: Path) -> None:
    """Write the pages, and link the names in the page of public names to them.

    Parameters
    ----------
    root
        The repository.
    source
        Folder of the sources of the site, with its pages.
    """
    text = (root / "docs" / "api.md").read_text(encoding="utf-8")
    folder = source / "reference"
    folder.mkdir(exist_ok=True)
    pages = []
    _, *pieces = re.split(r"^## (.+)$", text, flags=re.MULTILINE)
    for title, section in zip(pieces[::2], pieces[1::2], strict=True):
        homes = [row[2] for row in ROW.findall(section)]
        if homes:
            name = title.lower().replace(" ", "_")
            entries = "\n".join(_entry(home) for home in homes)
            (folder / f"{name}.rst").write_text(f"{title}\n{'=' * len(title)}\n\n{entries}", encoding="utf-8")
            pages.append(f"reference/{name}")
    page = source / "api.md"
    linked = ROW.sub(r"| {py:obj}`\1 <\3>` |\2| `\3` |", page.read_text(encoding="utf-8"))
    listed = "\n".join(["```{toctree}", ":hidden:", "", *pages, "```"])
    page.write_text(f"{linked}\n{listed}\n", encoding="utf-8")


def _entry(home: str) -> str:
    """Directive that shows an object by its docstring."""
    module, _, name = home.rpartition(".")
    value = getattr(importlib.import_module(module), name)
    if inspect.isclass(value):
        kind, options = "autoexception" if issubclass(value, Exception) else "autoclass", "   :members:\n"
    elif callable(value):
        kind, options = "autofunction", ""
    else:
        kind, options = "autodata", "   :no-value:\n"
    return f".. {kind}:: {home}\n{options}"
