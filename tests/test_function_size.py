"""No function of the product is over 80 lines or takes more than 10 arguments; compiled kernels may."""

import ast
import tomllib
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGES: list[str] = SETTINGS["tool"]["importlinter"]["root_packages"]
MOST_LINES, MOST_ARGUMENTS = 80, 10
#: Decorators of functions that numba compiles: they take plain arrays, since objects would be slower there.
COMPILED = {"compiled", "compiled_template", "njit", "jit", "vectorize", "guvectorize", "cfunc"}


def is_compiled(function: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    """Whether numba compiles a function."""
    heads = [item.func if isinstance(item, ast.Call) else item for item in function.decorator_list]
    return any(
        (head.attr if isinstance(head, ast.Attribute) else getattr(head, "id", "")) in COMPILED for head in heads
    )


def too_large(source: str) -> Iterator[str]:
    """Names of functions that are too long or take too much; `self` and `cls` do not count."""
    for function in ast.walk(ast.parse(source)):
        if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef) and not is_compiled(function):
            given = function.args
            names = [item.arg for item in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
            count = len([name for name in names if name not in {"self", "cls"}]) + len(
                [item for item in (given.vararg, given.kwarg) if item]
            )
            lines = (function.end_lineno or 0) - function.lineno + 1
            if lines > MOST_LINES or count > MOST_ARGUMENTS:
                yield function.name


def test_functions_of_the_product_are_short_and_take_few_arguments() -> None:
    result = {
        f"{file.relative_to(ROOT)} {name}"
        for package in PACKAGES
        for file in sorted((ROOT / package).rglob("*.py"))
        for name in too_large(file.read_text(encoding="utf-8"))
    }
    assert not result, f"over {MOST_LINES} lines or {MOST_ARGUMENTS} arguments: {sorted(result)}"


def test_long_functions_and_many_arguments_are_seen_and_kernels_are_not() -> None:
    many = ", ".join(f"a{number}" for number in range(11))
    assert list(too_large(f"class C:\n    def f(self, {many}): ...")) == ["f"]
    assert not list(too_large(f"class C:\n    def f(self, {many[:38]}): ..."))
    assert not list(too_large(f"@compiled(cache=True)\ndef f({many}): ..."))
    assert not list(too_large(f"@numba.njit\ndef f({many}): ..."))
    assert list(too_large("def f():\n" + "    x = 1\n" * 80)) == ["f"]
    assert not list(too_large("def f():\n" + "    x = 1\n" * 79))
