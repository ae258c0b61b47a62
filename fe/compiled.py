"""Compiling a function to machine code, kept on disk until any of the compiled code changes.

numba keeps compiled functions by the file that holds them, and does not see a change in what they call from another
file. Here they are kept in a folder whose name is a hash of the code of all rooms that compile, so that stale machine
code cannot be found.
"""

import hashlib
import os
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])

#: Rooms that compile functions.
ROOMS = ("hbsolve", "transient")


def compiled(function: F) -> F:
    """Compile on the first call; without bounds checks, so array shapes are the caller's care."""
    from numba import config, njit

    before, config.CACHE_DIR = config.CACHE_DIR, str(_folder())
    try:
        machine: F = njit(cache=True, error_model="numpy")(function)
    finally:
        config.CACHE_DIR = before
    return machine


@cache
def _folder() -> Path:
    """Where compiled code is kept: numba's folder if the user named one, else the user's cache, else a passing one."""
    from platformdirs import user_cache_path

    digest = hashlib.sha256()
    root = Path(__file__).parent.parent
    for room in ROOMS:
        for file in sorted((root / room).rglob("*.py")):
            digest.update(file.read_bytes())
    named = os.environ.get("NUMBA_CACHE_DIR")
    folder = Path(named) if named else user_cache_path("stickslip", appauthor=False) / "compiled"
    try:
        folder = folder / digest.hexdigest()[:16]
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError:
        return Path(tempfile.mkdtemp(prefix="stickslip-compiled-"))
