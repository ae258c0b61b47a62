"""Compiling a function to machine code, kept on disk until any of the compiled code changes.

numba keeps compiled functions by the file that holds them, and does not see a change in what they call from another
file. Here they are kept in a folder whose name is a hash over all files of the room that compile or define what
compiled functions exchange, so that stale machine code cannot be found.
"""

import hashlib
import os
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

F = TypeVar("F", bound=Callable[..., Any])

#: A file that holds one of these takes part in compiled code.
MARKS = (b"fe.compiled", b"NamedTuple", b"import intrinsic", b"fe.sparse.vector_code")


def compiled(function: F) -> F:
    """Compile on the first call; without bounds checks, so array shapes are the caller's care."""
    import numba

    config: Any = numba.config
    before, config.CACHE_DIR = config.CACHE_DIR, str(_folder(function.__module__.partition(".")[0]))
    try:
        machine: Any = numba.njit(cache=True, error_model="numpy")(function)
    finally:
        config.CACHE_DIR = before
    return cast(F, machine)


@cache
def _folder(room: str) -> Path:
    """Where compiled code is kept: numba's folder if the user named one, else the user's cache, else a passing one."""
    from platformdirs import user_cache_path

    digest = hashlib.sha256()
    for file in sorted((Path(__file__).parent.parent / room).rglob("*.py")):
        code = file.read_bytes()
        if any(mark in code for mark in MARKS):
            digest.update(code)
    named = os.environ.get("NUMBA_CACHE_DIR")
    folder = Path(named) if named else user_cache_path("stickslip", appauthor=False) / "compiled"
    try:
        folder = folder / digest.hexdigest()[:16]
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError:
        return Path(tempfile.mkdtemp(prefix="stickslip-compiled-"))
