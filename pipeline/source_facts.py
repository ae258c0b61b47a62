"""Facts of a source file for the cache: a hash of its code, and its imports.

Parsing hundreds of files takes a second. The facts are therefore stored by the file's content, next to the results of
stages: an edited file is parsed again, and a store that is damaged or cannot be written only costs time.
"""

import ast
import atexit
import hashlib
import json
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from pipeline.cache_folder import default_folder
from pipeline.output import replace_file

FILE = "source_facts.json"
#: Version of the stored content and of Python's format of a tree.
FORMAT = f"2, python {sys.version_info[:3]}"
#: Largest number of remembered files.
MAX_FILES = 4000


class SourceFacts(NamedTuple):
    """Facts of one source file."""

    code: str
    """Hash of the code without comments, docstrings and layout."""
    modules: tuple[str, ...]
    """Of ``import module``."""
    names: tuple[tuple[str, tuple[str, ...]], ...]
    """Of ``from module import names``."""
    packages: tuple[str, ...]
    """Packages in which a registry made here looks for its members."""


@cache
def find_source_facts(file: Path) -> SourceFacts:
    """Facts of a file."""
    content = file.read_bytes()
    key = hashlib.sha256(content).hexdigest()
    known = _read_stored()
    if key not in known:
        known[key] = _parse(content)
        _save_at_exit()
    return known[key]


def _parse(content: bytes) -> SourceFacts:
    tree = ast.parse(content)
    modules: list[str] = []
    names: list[tuple[str, tuple[str, ...]]] = []
    packages: list[str] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            modules += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names.append((node.module, tuple(alias.name for alias in node.names)))
        elif isinstance(node, ast.Call):
            packages += _list_packages_of_members(node)
    code = hashlib.sha256(ast.dump(_drop_docstrings(tree)).encode()).hexdigest()
    return SourceFacts(code, tuple(modules), tuple(names), tuple(packages))


def _list_packages_of_members(call: ast.Call) -> Iterator[str]:
    if getattr(call.func, "id", "") == "Registry":
        yield from (
            keyword.value.value
            for keyword in call.keywords
            if keyword.arg == "package"
            and isinstance(keyword.value, ast.Constant)
            and isinstance(keyword.value.value, str)
        )


def _drop_docstrings(tree: ast.Module) -> ast.Module:
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and ast.get_docstring(
            node, clean=False
        ):
            node.body = node.body[1:]
    return tree


@cache
def _read_stored() -> dict[str, SourceFacts]:
    """Facts from earlier runs by the hash of the content."""
    try:
        stored = json.loads((default_folder() / FILE).read_text(encoding="utf-8"))
        # A changed byte in them may leave out a file that a result depends on.
        if stored["format"] != FORMAT or stored["sha256"] != _compute_checksum(stored["facts"]):
            return {}
        return {
            key: SourceFacts(
                str(code), tuple(modules), tuple((module, tuple(names)) for module, names in imported), tuple(packages)
            )
            for key, (code, modules, imported, packages) in stored["facts"].items()
        }
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return {}


def _compute_checksum(facts: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(facts).encode()).hexdigest()


@cache
def _save_at_exit() -> None:
    """Save once per run, whatever the number of parsed files."""
    owner = os.getpid()

    def save() -> None:
        if os.getpid() != owner:
            return
        facts = dict(list(_read_stored().items())[-MAX_FILES:])
        with suppress(OSError):
            default_folder().mkdir(parents=True, exist_ok=True)
            stored = {"format": FORMAT, "sha256": _compute_checksum(facts), "facts": facts}
            replace_file(default_folder() / FILE, json.dumps(stored))

    atexit.register(save)
