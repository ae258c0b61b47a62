"""A stored result is found again only while all the code behind it is unchanged."""

import ast
import importlib
import pkgutil
from functools import cache
from pathlib import Path

import pytest

import study
from pipeline.code_dependencies import dependencies
from pipeline.store import Stage


def stages() -> dict[str, Stage]:
    result = {}
    for info in pkgutil.walk_packages(study.__path__, "study."):
        if info.name != "study.__main__":
            for name, value in vars(importlib.import_module(info.name)).items():
                if isinstance(value, Stage) and value.compute.__module__ == info.name:
                    result[f"{info.name}.{name}"] = value
    return result


STAGES = stages()


def test_the_stages_are_found() -> None:
    assert {
        "study.table1.stages.row",
        "study.table1.stages.prediction",
        "study.kind.blade.reduce.reduced_blade",
    } <= set(STAGES)


@cache
def imported_modules(file: Path) -> frozenset[str]:
    """Modules of the product from which a file imports, read independently of `pipeline.source_facts`."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    imported = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module}
    return frozenset(name for name in imported if name.partition(".")[0] in ("fe", "reduction", "hbsolve", "study"))


@pytest.mark.parametrize("name", STAGES)
def test_a_stage_depends_on_every_module_of_the_product_that_its_code_imports(name: str) -> None:
    result = dependencies(STAGES[name].compute.__module__)
    for file in result.values():
        own = imported_modules(file)
        assert own <= set(result), f"{name} would be found in the store after a change of {sorted(own - set(result))}"


def test_the_form_of_a_record_is_among_the_dependencies_of_a_stage() -> None:
    for name, stage in STAGES.items():
        assert {"pipeline.codec", "pipeline.record"} <= set(dependencies(stage.compute.__module__)), name


def test_a_cycle_of_imports_ends_and_installed_packages_are_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "ring_a.py").write_text("import numpy\nimport json\ndef later():\n    import ring_b\n")
    (tmp_path / "ring_b.py").write_text("from ring_a import later\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert set(dependencies("ring_a")) == {"ring_a", "ring_b"}


def test_a_package_that_is_imported_itself_counts_with_all_its_modules(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "found_members"
    folder.mkdir()
    (folder / "__init__.py").write_text("MEMBERS = ()\n")
    (folder / "one.py").write_text("")
    (tmp_path / "asks.py").write_text("from found_members import MEMBERS\n")
    (tmp_path / "names.py").write_text("from found_members.one import X\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert "found_members.one" in dependencies("asks")
    assert "found_members" not in dependencies("names")


def test_a_module_that_makes_a_registry_depends_on_the_members_that_it_will_find(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "swept_members"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    (folder / "one.py").write_text("")
    (tmp_path / "sweeps.py").write_text("R = Registry('thing', package='swept_members', group=None)\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert {"swept_members", "swept_members.one"} <= set(dependencies("sweeps"))


def test_every_joint_law_and_its_force_count_for_a_response_curve() -> None:
    assert {"reduction.joint_law.jenkins", "hbsolve.joint_law.jenkins"} <= set(dependencies("study.solve.curve"))
