"""The wheel holds all that the program reads, and nothing of the checkout besides."""

import tomllib
import zipfile
from pathlib import Path

import pytest
from hatchling.builders.wheel import WheelBuilder

ROOT = Path(__file__).parents[2]
PACKAGES = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]["wheel"][
    "packages"
]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    folder = tmp_path_factory.mktemp("wheel")
    (file,) = WheelBuilder(str(ROOT)).build(directory=str(folder), versions=["standard"])
    return zipfile.ZipFile(file)


def test_every_file_of_every_package_is_in_it(wheel: zipfile.ZipFile) -> None:
    there = {
        str(file.relative_to(ROOT))
        for package in PACKAGES
        for file in (ROOT / package).rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    }
    packed = {name for name in wheel.namelist() if ".dist-info/" not in name}
    assert packed == there
    # Kinds of data that the program reads: shipped cases, matrices, detection thresholds, pages.
    assert {Path(name).suffix for name in packed} >= {".py", ".toml", ".npz", ".json", ".j2", ".js", ".typed"}


def test_every_package_of_the_checkout_is_in_it_and_says_that_it_is_typed(wheel: zipfile.ZipFile) -> None:
    product = {file.parent.name for file in ROOT.glob("*/__init__.py")} - {"tests", "benchmarks", "examples"}
    assert set(PACKAGES) == product
    assert {f"{package}/py.typed" for package in PACKAGES} <= set(wheel.namelist())


def test_its_command_is_the_one_that_names_hiding_folders(wheel: zipfile.ZipFile) -> None:
    (name,) = (name for name in wheel.namelist() if name.endswith("entry_points.txt"))
    assert "stickslip = stickslip.__main__:main" in wheel.read(name).decode()
