"""Sphinx's configuration of the site; `docs/build.py` calls it."""

import importlib.metadata
import os
import sys
from pathlib import Path

WEBSITE = Path(__file__).parent
sys.path[:0] = [str(WEBSITE.parent), str(WEBSITE.parents[1])]

from website.sphinx_gallery_source import PAGES, SCRIPTS, is_run  # noqa: E402  # the path is set above

EXAMPLES = os.environ["STICKSLIP_SITE_EXAMPLES"]
RUN = [path.stem for path in (WEBSITE.parents[1] / "examples").glob("*.py") if is_run(path.stem, EXAMPLES)]

project = "stickslip"
author = "the authors of stickslip"
release = importlib.metadata.version("stickslip")
extensions = [
    "myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_gallery.gen_gallery", "website.docstrings",
    "website.math_ml",
]  # fmt: skip
exclude_patterns = [SCRIPTS, "files"]
templates_path: list[str] = []

# Markdown: anchors as on a Git host, equations between dollars.
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
html_math_renderer = "mathml"
# Blocks without a language are command lines, cases and tables of numbers.
highlight_language = "none"

# Docstrings name things in single backticks, without a role.
default_role = "code"
napoleon_google_docstring = False
autodoc_typehints_format = "short"
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
maximum_signature_line_length = 80

sphinx_gallery_conf = {
    "examples_dirs": str(Path(os.environ["STICKSLIP_SITE_SOURCE"]) / SCRIPTS),
    "gallery_dirs": PAGES,
    "filename_pattern": rf"/({'|'.join(RUN) or 'none'})\.py$",
    "image_scrapers": ("website.pictures.written_pictures",),
    "plot_gallery": bool(RUN),
    "download_all_examples": False,
    "remove_config_comments": True,
    "show_memory": False,
    "show_signature": False,
    "min_reported_time": 1e9,
    "reset_modules": ("website.script_path.set_script_path",),
    "write_computation_times": False,  # its page loads scripts from elsewhere
    "copyfile_regex": r".*\.rst",
    "nested_sections": False,
    "default_thumb_file": str(WEBSITE / "static" / "loop.png"),
    "within_subsection_order": "FileNameSortKey",
    "ignore_pattern": r"$^",
}

html_theme = "furo"
html_title = "stickslip"
html_static_path = [str(WEBSITE / "static")]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
html_last_updated_fmt = None
html_show_sphinx = False
html_show_copyright = False
