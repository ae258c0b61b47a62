"""Trust in the Python files that a case names: files of other users run only after the user has agreed once.

A file is the user's own if nobody else can have changed it: the user (or the system) owns the file and its folder, and
others may not write to either. Git has the same rule for repositories (`safe.directory`). Trusted files are remembered
by path and content.
"""

import hashlib
import json
import os
import stat
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path

from geometry.errors import InputError
from pipeline.cache_folder import default_folder
from pipeline.output import replace_file

#: Whether `--trust` was given.
_TRUSTS: ContextVar[bool] = ContextVar("trusts the code of cases", default=False)
FILE = "trusted_code.json"


class UntrustedCode(InputError):
    """A Python file of a case belongs to another user or can be changed by others."""


def trust_code(trusts: bool = True) -> None:
    """Trust all Python files that cases name from now on; same as ``--trust``."""
    _TRUSTS.set(trusts)


@contextmanager
def trusting() -> Iterator[None]:
    """Apply `trust_code` within a block."""
    token = _TRUSTS.set(True)
    try:
        yield
    finally:
        _TRUSTS.reset(token)


def require_trust(files: Sequence[Path], case: Path) -> None:
    """Refuse files of a case that are neither the user's own nor trusted; at a terminal, ask the user once.

    Parameters
    ----------
    files
        Python files; for a file that does not exist yet, its folder is checked.
    case
        Case file that names the files.

    Raises
    ------
    UntrustedCode
        The user does not trust the files, or cannot be asked.
    """
    known = _read_remembered()
    marks = {_mark(file): file for file in files if not is_own(file)}
    foreign = [file for mark, file in marks.items() if mark not in known]
    if not foreign:
        return
    listed = ", ".join(str(file) for file in foreign)
    if not (
        _TRUSTS.get() or _agrees(f"{case} runs Python code that belongs to another user: {listed}. Run it? [y/N] ")
    ):
        raise UntrustedCode(
            f"{case} runs Python code that belongs to another user or that others may change ({listed}): read it, "
            "then add --trust, or call trust_code() of study.case.trust in Python"
        )
    with suppress(OSError):  # without a stored answer, the user is asked again
        default_folder().mkdir(parents=True, exist_ok=True)
        replace_file(default_folder() / FILE, json.dumps(sorted({*known, *marks})))


def is_own(file: Path) -> bool:
    """Whether the user or the system owns a file (if it exists) and its folder, and nobody else may write to them."""
    for place in (file.resolve(), file.resolve().parent):
        if place == file.resolve() and not place.exists():
            continue
        status = place.stat()
        others_write = status.st_mode & stat.S_IWOTH and not (place.is_dir() and status.st_mode & stat.S_ISVTX)
        if status.st_uid not in {os.getuid(), 0} or others_write:
            return False
    return True


def _agrees(question: str) -> bool:
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return False
    sys.stderr.write(question)
    sys.stderr.flush()
    return sys.stdin.readline().strip().lower() in {"y", "yes"}


def _mark(file: Path) -> str:
    content = file.read_bytes() if file.is_file() else b""
    return hashlib.sha256(str(file.resolve()).encode() + b"\0" + content).hexdigest()


def _read_remembered() -> set[str]:
    try:
        marks = json.loads((default_folder() / FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return set()
    return {mark for mark in marks if isinstance(mark, str)} if isinstance(marks, list) else set()
