"""Text of a case: its hash, and changes to the names of its effect files."""

import tomllib
from collections.abc import Sequence
from hashlib import sha256
from typing import Any

from casefile.errors import CaseError, Problem
from study.diagnose.edit import UneditableLayout, edit_tables


def hash_text(text: str) -> str:
    """Hash of a text, by which a page detects that the text has changed."""
    return sha256(text.encode("utf-8")).hexdigest()


def list_effect_files(text: str) -> list[str]:
    """List the names in ``[effects] files`` of a case; empty for a text that is not a case."""
    try:
        table = tomllib.loads(text.removeprefix("\ufeff")).get("effects", {})
    except (ValueError, RecursionError):
        return []
    files = table.get("files", []) if isinstance(table, dict) else []
    return [name for name in files if isinstance(name, str)] if isinstance(files, list) else []


def with_effect_files(text: str, files: Sequence[str], file: str = "the case") -> str:
    """Set the names of the effect files in the text of a case.

    Parameters
    ----------
    text
        Text of the case.
    files
        Names of all effect files.
    file
        Name of the case, for messages.

    Raises
    ------
    CaseError
        The layout of the text cannot be edited.
    """

    def name_them(before: dict[str, Any]) -> dict[str, Any]:
        return before | {"effects": before.get("effects", {}) | {"files": list(files)}}

    try:
        return edit_tables(text, name_them, lambda pieces: _named(pieces, files))
    except UneditableLayout:
        listed = ", ".join(f'"{name}"' for name in files)
        reason = f"cannot be edited, as its tables are laid out in another way: write files = [{listed}] into [effects]"
        raise CaseError([Problem(file=file, line=0, key="effects", text=reason)]) from None


def _named(pieces: Sequence[str], files: Sequence[str]) -> str:
    import tomlkit

    for number, piece in enumerate(pieces):
        if "effects" not in piece:
            continue
        document: Any = tomlkit.parse(piece)
        table = document.get("effects")
        if not isinstance(table, dict):
            continue
        before = list(table.get("files", []))
        if before and list(files[: len(before)]) == before:
            table["files"].extend(files[len(before) :])  # keeps comments and line breaks of the list
        else:
            table["files"] = list(files)
        return "".join([*pieces[:number], tomlkit.dumps(document), *pieces[number + 1 :]])
    new: Any = tomlkit.document()
    new["effects"] = {"files": list(files)}
    return f"{''.join(pieces).rstrip()}\n\n{tomlkit.dumps(new)}"
