"""The documentation as a site: ``python docs/build.py`` writes ``build/site/index.html``, without a network.

The pages are those of ``docs/``, with a page for each public name and one for each example. Every warning of Sphinx is
an error. By default only the examples that take seconds are run, and kept pictures stand for the others;
``--examples all`` runs all, ``--examples none`` runs none.
"""

import argparse
import importlib.util
import os
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

DOCS = Path(__file__).parent
ROOT = DOCS.parent
#: Packages of the extra `docs`.
NEEDED = ("furo", "myst_parser", "sphinx", "sphinx_gallery")
#: File in the folder of sources that were written here.
MARK = ".sources-of-the-site"
sys.path[:0] = [str(DOCS), str(ROOT)]


def build_site(out: Path, *, examples: str = "cheap") -> int:
    """Build the site.

    Parameters
    ----------
    out
        Folder of the site; its sources are beside it, in ``OUT.source``.
    examples
        Which examples are run: ``"cheap"``, ``"all"`` or ``"none"``.

    Returns
    -------
    Exit code of Sphinx: 0 without any warning.
    """
    from sphinx.cmd.build import build_main
    from website.pages import write_pages
    from website.reference import write_reference
    from website.sphinx_gallery_source import write_examples

    source = out.with_name(f"{out.name}.source")
    # Those of an earlier site are removed, and no folders of anything else.
    for folder, mark in ((source, MARK), (out, ".buildinfo")):
        if (folder / mark).is_file():
            shutil.rmtree(folder)
    source.mkdir(parents=True, exist_ok=True)
    (source / MARK).touch()
    write_pages(ROOT, source)
    write_reference(ROOT, source)
    write_examples(ROOT, source, examples)
    os.environ |= {"STICKSLIP_SITE_EXAMPLES": examples, "STICKSLIP_SITE_SOURCE": str(source)}
    configuration = str(DOCS / "website")
    return build_main(["-W", "--keep-going", "-q", "-E", "-b", "html", "-c", configuration, str(source), str(out)])


def main(arguments: Sequence[str] | None = None) -> int:
    """Build the site as the command line says."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n\n")[0])
    parser.add_argument("--examples", choices=("cheap", "all", "none"), default="cheap", help="which examples are run")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "site", help="folder of the site")
    options = parser.parse_args(arguments)
    missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if missing:
        sys.stderr.write(
            f'{", ".join(missing)} not installed: run sh install.sh, or in a checkout pip install -e ".[docs]"\n'
        )
        return 2
    code = build_site(options.out.resolve(), examples=options.examples)
    sys.stdout.write(f"{options.out / 'index.html'}\n" if code == 0 else "the site has the errors above\n")
    return code


if __name__ == "__main__":
    sys.exit(main())
