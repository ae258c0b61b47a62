"""Every example runs as it stands, checks itself against theory, and is short."""

import ast
import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

from figure.scene.off_screen import require_egl
from geometry.errors import MissingSoftware

TIMEOUT = 300  # s; a hang is an error, a slow machine is none
EXAMPLES = sorted((Path(__file__).parents[1] / "examples").glob("*.py"))
#: Lines: what fits on two screens, figure and check included.
LONGEST = 95
#: Those that the README shows must not be lost from the glob.
SHOWN = {
    "geometry_to_rom.py", "mode_shape_screenshot.py", "forced_response.py", "blade_with_friction.py",
    "find_the_missing_effect.py", "own_effect.py", "silverbox.py", "rig_forced_response.py",
    "import_matrices.py", "campaign_from_uff.py",
    "stability.py", "isolas.py", "backbone.py", "own_joint_law.py", "single_frequency_limits.py",
    "response_limits.py", "own_step_to_rom.py", "virtual_tests.py", "uncertain_parameters.py",
    "response_control.py", "see_the_missing_law.py", "plan_the_next_test.py",
}  # fmt: skip
#: Those that take minutes run where STICKSLIP_SLOW is set; tests of their packages take the same steps on less data.
SLOW = {
    "rig_forced_response.py", "own_step_to_rom.py", "response_control.py",
    "own_joint_law.py", "single_frequency_limits.py", "blade_with_friction.py", "virtual_tests.py",
    "find_the_missing_effect.py", "uncertain_parameters.py", "isolas.py", "backbone.py", "response_limits.py",
    "stability.py", "see_the_missing_law.py", "plan_the_next_test.py", "campaign_from_uff.py", "import_matrices.py",
}  # fmt: skip
SLOW_TIMEOUT = 1500  # s
#: Arguments of those that do less if asked: what they check is the same.
EFFORT = {"response_limits.py": ("4",), "virtual_tests.py": ("2",)}


def test_the_examples_are_found() -> None:
    assert {path.name for path in EXAMPLES} >= SHOWN


def test_the_list_of_examples_has_the_first_sentence_of_each() -> None:
    rows = []
    for path in EXAMPLES:
        sentence = (ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").split("\n\n")[0]
        rows.append(f"| [`{path.name}`]({path.name}) | {' '.join(sentence.split())} |")
    page = EXAMPLES[0].with_name("README.md").read_text(encoding="utf-8")
    assert page.splitlines()[-len(rows) :] == rows


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs_and_is_short(path: Path, tmp_path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) < LONGEST
    assert "assert " in text  # it ends in a check
    if "mode_picture" in text:
        try:
            require_egl()
        except MissingSoftware as reason:
            pytest.skip(str(reason))
    if "tet_mesher" in text and importlib.util.find_spec("pytetwild") is None:
        pytest.skip("pytetwild is not installed: pip install stickslip[tets]")
    if path.name in SLOW and not os.environ.get("STICKSLIP_SLOW"):
        pytest.skip("takes minutes: set STICKSLIP_SLOW=1 to run it")
    timeout = SLOW_TIMEOUT if path.name in SLOW else TIMEOUT
    done = subprocess.run(
        [sys.executable, str(path), *EFFORT.get(path.name, ())],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )
    # Where machine code is not stored yet, a line says that it is compiled.
    said = [line for line in done.stderr.splitlines() if "compiling" not in line]
    assert (done.returncode, said) == (0, [])
    assert done.stdout
    # What it says that it wrote is there.
    assert all((tmp_path / word).is_file() for word in done.stdout.replace(",", " ").split() if word.endswith(".png"))
