"""A kept result is found again only while all the code behind it is unchanged."""

import ast
import importlib
import pkgutil
from pathlib import Path

import pytest

import study
from study.store import Stage

#: Modules of `study` that only carry inputs, results and messages: what they say is no number of a result.
CARRIERS = {
    "study.case",
    "study.doctor",
    "study.errors",
    "study.made_folders",
    "study.output",
    "study.parallel",
    "study.progress",
    "study.quantity",
    "study.run_context",
    "study.store",
}


def imported(module: str) -> set[str]:
    """Modules of `study` that a module imports by name, figures aside."""
    file = importlib.import_module(module).__file__
    assert file is not None
    tree = ast.parse(Path(file).read_text(encoding="utf-8"))
    found = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module}
    return {name for name in found if name.startswith("study.") and not name.startswith("study.figure")} - CARRIERS


def stages() -> dict[str, Stage]:
    found = {}
    for info in pkgutil.walk_packages(study.__path__, "study."):
        if info.name == "study.__main__" or info.name.startswith("study.figure"):
            continue
        for name, value in vars(importlib.import_module(info.name)).items():
            if isinstance(value, Stage) and value.compute.__module__ == info.name:
                found[f"{info.name}.{name}"] = value
    return found


STAGES = stages()


def test_the_stages_are_found() -> None:
    assert {"study.table1.chain.row", "study.table1.prediction.prediction", "study.reduce_run.reduced_blade"} <= set(
        STAGES
    )


@pytest.mark.parametrize("name", STAGES)
def test_a_stage_depends_on_every_module_that_its_code_imports(name: str) -> None:
    stage = STAGES[name]
    modules = [room for room in stage.rooms if room.startswith("study.") and room != "study.codec"]
    needed = set().union(*map(imported, modules))
    # `reduce` also runs the stage of the CAD solid, beside its own and not within it.
    missing = needed - set(stage.rooms) - ({"study.solid_check"} if "study.reduce_run" in modules else set())
    assert not missing, f"{name} would be found in the store after a change of {sorted(missing)}"
