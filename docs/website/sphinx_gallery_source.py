"""Sources of the gallery: each example as it stands, with a title, and the kept picture of what is not run."""

import ast
import re
import shutil
from pathlib import Path

#: Examples that take some seconds each; `--examples all` runs the others too.
CHEAP = (
    "forced_response", "geometry_to_rom", "import_matrices", "mode_shape_screenshot", "own_effect", "response_control",
)  # fmt: skip
#: Examples of measured data that the repository does not have: they end without them.
WITHOUT_DATA = ("brake_reuss", "silverbox")
#: Kept pictures in `docs/pictures` of what examples draw.
KEPT = {
    "backbone": "backbone.png",
    "blade_with_friction": "blade_with_friction.png",
    "find_the_missing_effect": "missing_effect.png",
    "forced_response": "forced_response.png",
    "isolas": "isolas.png",
    "mode_shape_screenshot": "mode1_stress.png",
    "own_joint_law": "own_joint_law.png",
    "own_step_to_rom": "own_part.png",
    "plan_the_next_test": "next_test.png",
    "response_control": "force_surface.png",
    "response_limits": "response_limits.png",
    "rig_forced_response": "rig_assembly.png",
    "single_frequency_limits": "single_frequency_limits.png",
    "stability": "stability.png",
    "uncertain_parameters": "spread_band.png",
    "virtual_tests": "virtual_tests.png",
}
#: Folder of the scripts within the sources, and of their pages.
SCRIPTS, PAGES = "scripts", "examples"
#: Folders with a README would become galleries of their own.
IGNORED = shutil.ignore_patterns("__pycache__", "README.md")
HEADER = """\
Examples
========

Short scripts, each of which ends in a check. ``python examples/NAME.py`` runs one and writes its files into the current
folder. Pictures of examples that take long were drawn before.
"""
WORDS = {"rom": "ROM", "step": "STEP", "uff": "UFF", "reuss": "Reuss"}


def is_run(script: str, examples: str) -> bool:
    """Whether the site runs a script.

    Parameters
    ----------
    script
        Its name without suffix.
    examples
        ``"cheap"``, ``"all"`` or ``"none"``.
    """
    if script in WITHOUT_DATA:
        return False
    return examples == "all" or (examples == "cheap" and script in CHEAP)


def write_examples(root: Path, source: Path, examples: str) -> None:
    """Copy the examples into the sources of the site.

    Parameters
    ----------
    root
        The repository.
    source
        Folder of the sources of the site.
    examples
        As in `is_run`.
    """
    folder = source / SCRIPTS
    # The whole folder, because examples read files beside them.
    shutil.copytree(root / "examples", folder, ignore=IGNORED, dirs_exist_ok=True)
    for script in sorted(folder.glob("*.py")):
        picture = None if is_run(script.stem, examples) else KEPT.get(script.stem)
        if picture is not None:
            (source / "pictures").mkdir(exist_ok=True)
            shutil.copyfile(root / "docs" / "pictures" / picture, source / "pictures" / picture)
        script.write_text(_page(script.read_text(encoding="utf-8"), script.stem, picture), encoding="utf-8")
    (folder / "GALLERY_HEADER.rst").write_text(HEADER, encoding="utf-8")


def _page(text: str, name: str, picture: str | None) -> str:
    """Script whose docstring has a title and a picture, as sphinx-gallery expects it."""
    tree = ast.parse(text)
    said = ast.get_docstring(tree) or ""
    code = "\n".join(text.splitlines()[tree.body[0].end_lineno or 0 :])
    title = " ".join(WORDS.get(word, word) for word in name.split("_"))
    title = title[0].upper() + title[1:]
    # A command line among the sentences stands by itself.
    said = re.sub(r"^(python .*)$", r"::\n\n    \1", said, flags=re.MULTILINE).replace("\\", "\\\\")
    shown = f"\n.. image:: /pictures/{picture}\n   :alt: {title}\n" if picture else ""
    thumbnail = f"# sphinx_gallery_thumbnail_path = 'pictures/{picture}'\n" if picture else ""
    return f'"""\n{title}\n{"=" * len(title)}\n\n{said}\n{shown}"""\n{thumbnail}{code}\n'
