"""Tests that hold for every member of a kind, taken from the modules where they run for the product's own members."""

import inspect
from collections.abc import Iterator
from types import ModuleType


def sweeps(fixture: str, *modules: ModuleType) -> Iterator[tuple[str, object]]:
    """Tests that take the fixture and are not written for certain members, by a name of their own."""
    for module in modules:
        for name, test in vars(module).items():
            marks = [mark.args[0] for mark in getattr(test, "pytestmark", []) if mark.name == "parametrize"]
            if name.startswith("test_") and fixture in inspect.signature(test).parameters and fixture not in marks:
                yield f"{name}_in_{module.__name__.rpartition('.')[2]}", test
