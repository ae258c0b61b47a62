"""`import stickslip`: names, homes, what type checkers see and what is documented agree; nothing heavy is loaded."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import stickslip
from stickslip._packages import PACKAGES

ROOT = Path(__file__).parents[2]
#: What takes long to import, and what only pictures, solids or compiled code need.
HEAVY = {"numpy", "scipy", "numba", "cadquery", "OCP", "vtkmodules", "pyvista", "matplotlib", "xarray", "pandas"}


def test_every_name_is_there_and_lies_in_its_room() -> None:
    for name in stickslip.__all__:
        assert getattr(stickslip, name) is not None
        assert stickslip._HOME[name].partition(".")[0] in PACKAGES
    assert set(dir(stickslip)) == set(stickslip.__all__)


def test_type_checkers_see_the_same_names_from_the_same_modules() -> None:
    tree = ast.parse(Path(stickslip.__file__).read_text(encoding="utf-8"))
    block = next(item for item in tree.body if isinstance(item, ast.If))
    seen = {}
    for line in block.body:
        assert isinstance(line, ast.ImportFrom)
        seen |= {item.asname: f"{line.module}:{item.name}" for item in line.names}
    assert seen == stickslip._HOME


def test_the_documentation_lists_the_names_with_their_homes() -> None:
    text = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    listed = dict(re.findall(r"^\| `(\w+)` \|.*\| `([\w.]+)` \|$", text, flags=re.MULTILINE))
    assert listed == {name: home.replace(":", ".") for name, home in stickslip._HOME.items()}


def test_an_unknown_name_is_an_attribute_error_that_names_it() -> None:
    with pytest.raises(AttributeError, match="mesh_blde"):
        _ = stickslip.mesh_blde


@pytest.mark.parametrize("use", ["import stickslip", "import stickslip; dir(stickslip)", "import stickslip.__main__"])
def test_the_import_loads_nothing_heavy(use: str) -> None:
    script = f"{use}\nimport sys\nprint(*sorted(set(sys.modules) & {HEAVY | set(PACKAGES)!r}))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.split() == []


def test_the_help_loads_nothing_heavy() -> None:
    script = (
        "import runpy, sys\nsys.argv = ['stickslip', '--help']\n"
        "try:\n    runpy.run_module('stickslip', run_name='__main__')\n"
        f"except SystemExit as end:\n    print(end.code, *sorted(set(sys.modules) & {HEAVY!r}), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60)
    assert "stickslip COMMAND --help" in done.stdout
    assert done.stderr.split() == ["0"]


@pytest.mark.parametrize("package", ["geometry", "study", "figure"])
@pytest.mark.parametrize("is_file", [False, True])
def test_a_folder_that_hides_a_package_is_named_with_a_remedy(tmp_path: Path, package: str, is_file: bool) -> None:
    if is_file:
        (tmp_path / f"{package}.py").touch()
    else:
        (tmp_path / package).mkdir()
        (tmp_path / package / "__init__.py").touch()
    hiding = tmp_path / (f"{package}.py" if is_file else package)
    python = subprocess.run([sys.executable, "-c", "import stickslip; stickslip.Blade"], cwd=tmp_path,
                            capture_output=True, text=True, check=False, timeout=60)  # fmt: skip
    command = subprocess.run([sys.executable, "-m", "stickslip", "doctor"], cwd=tmp_path,
                             capture_output=True, text=True, check=False, timeout=60)  # fmt: skip
    for said in (python.stderr.splitlines()[-1], command.stderr):
        assert f"{hiding} hides the package {package} of stickslip: rename it" in said
    assert command.returncode == 2
    assert command.stderr.count("\n") == 1


def test_a_folder_without_python_files_hides_nothing(tmp_path: Path) -> None:
    (tmp_path / "geometry").mkdir()
    subprocess.run([sys.executable, "-c", "import stickslip; stickslip.Blade"], cwd=tmp_path, check=True, timeout=60)
