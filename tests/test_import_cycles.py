"""No module of the product imports itself by way of others, be it inside a function or for type checking alone."""

import ast
import tomllib
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGES: list[str] = SETTINGS["tool"]["importlinter"]["root_packages"]

#: Cycles that are still to be cut, by the modules in them; nothing may be added.
EXCEPTIONS: set[frozenset[str]] = set()


def module_name(file: Path) -> str:
    """Dotted name of a product file."""
    parts = file.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(file): file for package in PACKAGES for file in sorted((ROOT / package).rglob("*.py"))}


def imported(source: str, known: set[str]) -> Iterator[str]:
    """Known modules that a source imports, anywhere in it; of `from a import b` the module a.b if there is one."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                if whole in known:
                    yield whole
                elif node.module in known:
                    yield node.module


def cycles(graph: dict[str, set[str]]) -> set[frozenset[str]]:
    """Strongly connected components of more than one module, and modules that import themselves."""
    reach: dict[str, set[str]] = {}
    for start in graph:
        result, waiting = set[str](), [start]
        while waiting:
            for name in graph[waiting.pop()] - result:
                result.add(name)
                waiting.append(name)
        reach[start] = result
    return {frozenset(item for item in reach[name] if name in reach[item]) for name in graph if name in reach[name]}


def test_no_cycle_of_imports_in_the_product() -> None:
    graph = {name: set(imported(file.read_text(encoding="utf-8"), set(MODULES))) for name, file in MODULES.items()}
    result = cycles(graph)
    new = result - EXCEPTIONS
    assert not new, f"modules import each other in a circle: {[sorted(item) for item in new]}"
    assert not EXCEPTIONS - result, f"cut by now, take off the list: {[sorted(item) for item in EXCEPTIONS - result]}"


def test_a_cycle_by_way_of_a_function_and_a_package_is_seen() -> None:
    sources = {
        "a.one": "import numpy\ndef f():\n    from a import two",
        "a.two": "from a.three import g",
        "a.three": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import a.one",
        "a.four": "from a import one",
    }
    graph = {name: set(imported(text, set(sources))) for name, text in sources.items()}
    assert cycles(graph) == {frozenset({"a.one", "a.two", "a.three"})}
