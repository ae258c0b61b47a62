"""Compile functions to machine code, which is stored on disk until any of the compiled code changes.

numba stores compiled functions by the file that contains them, and does not detect a change of functions that they call
in another file. Here they are stored in a folder whose name is a hash over all files of the package that contain
compiled functions or define their arguments, so that outdated machine code is not found.

Compiling takes up to minutes, once: when it begins, a message is written to the logger `stickslip`, by default on
standard error. Code in damaged files is compiled again; on a full disk nothing is stored.
"""

import atexit
import hashlib
import logging
import multiprocessing
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar, cast

from fe.stored_code import checked_file_class, stored_library_class

F = TypeVar("F", bound=Callable[..., Any])

#: Texts that mark a file as part of the compiled code.
MARKS = (b"fe.compiled", b"NamedTuple", b"import intrinsic", b"fe.sparse.simd_code")
#: Part of the hash; to be changed with the layout of the stored files.
FORMAT = b"with checksums"
#: Time to compile a package, if it is long, on one otherwise idle core of 2024.
DURATION = {"fe": "about 15 seconds", "hbsolve": "up to a minute", "transient": "about 20 seconds"}
#: Names of these packages in messages.
SUBJECT = {"fe": "finite elements", "hbsolve": "solver", "transient": "time integration"}
#: Environment variable with the folder that is removed at the end of the run.
TEMPORARY_FOLDER = "STICKSLIP_PASSING_FOLDER"
#: Remedy for a folder that cannot be written.
REMEDY = "set NUMBA_CACHE_DIR to a writable folder with about 50 MB of free space"

log = logging.getLogger("stickslip")


ROOT = Path(__file__).parent.parent
#: Packages whose compiled functions another package calls.
CALLS = {"hbsolve": ("reduction",), "transient": ("reduction",), "correlation": ("reduction", "hbsolve")}


def compiled(function: F) -> F:
    """Compile a function on its first call. There are no bounds checks: the caller must ensure array shapes."""
    import numba

    package = function.__module__.partition(".")[0]
    machine: Any = numba.njit(error_model="numpy")(function)
    machine._cache = _StoredCode(function, package, _folder(package).path)
    return cast(F, machine)


def compiled_template(function: Callable[..., Any]) -> Callable[..., Any]:
    """Make a function that compiles copies of a template: ``make(module, name=other)`` replaces its global `name`.

    numba does not store machine code of functions that have a function as argument. A copy is stored for the calling
    module, which may have one copy of each template. `other` may be a function or a constant.
    """

    def make(module: str, **others: Any) -> Callable[..., Any]:
        code = function.__code__.replace(co_filename=str(sys.modules[module].__file__))
        copied = FunctionType(code, {**function.__globals__, **others, "__name__": module}, function.__name__)
        return compiled(cast(Callable[..., Any], copied))

    return make


def compiled_switch(
    module: str, arguments: str, cases: Sequence[Callable[..., Any]], other: tuple[Callable[..., Any], str]
) -> Callable[..., Any]:
    """Make a compiled function that calls one of several functions: ``switch(kind, address, ...)``.

    numba can choose among functions by number only if each call is written out, so the source is generated here.

    Parameters
    ----------
    module
        Name of the calling module, for which the machine code is stored.
    arguments
        Names of the arguments, separated by commas.
    cases
        Functions that are called with these arguments for kind = 0, 1, ...
    other
        Function that is called for any other kind, and the names of its arguments, which may include ``address``.
    """
    lines = [f"def switch(kind, address, {arguments}):"]
    lines += [f"    if kind == {number}:\n        return case_{number}({arguments})" for number in range(len(cases))]
    lines += [f"    return other({other[1]})"]
    scope = {f"case_{number}": case for number, case in enumerate(cases)} | {"other": other[0], "__name__": module}
    exec(compile("\n".join(lines), str(sys.modules[module].__file__), "exec"), scope)
    return compiled(cast(Callable[..., Any], scope["switch"]))


class _StoredCode:
    """numba's store of one function, which may be empty, damaged or full; it is opened on first use.

    Parameters
    ----------
    function
        Compiled function.
    package
        Package of the function.
    folder
        Folder of the store.
    """

    def __init__(self, function: Callable[..., Any], package: str, folder: Path) -> None:
        self._function, self._package, self._path = function, package, folder

    @cached_property
    def _store(self) -> Any:
        from numba import config
        from numba.core.caching import FunctionCache

        settings: Any = config
        before, settings.CACHE_DIR = settings.CACHE_DIR, str(self._path)
        try:
            store: Any = FunctionCache(self._function)
        finally:
            settings.CACHE_DIR = before
        store._cache_file.__class__ = checked_file_class()
        return store

    def __getattr__(self, name: str) -> Any:
        return getattr(self._store, name)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Machine code for arguments of these types; None, so that numba compiles it, if none can be read."""
        with suppress(ImportError, AttributeError):  # other versions of numba read all stored code
            target_context.codegen()._library_class = stored_library_class()
        try:
            # numba's `load_overload` first loads all its implementations, which takes a tenth of the time of a command
            # that compiles nothing. The compiler loads them anyway if something must be compiled.
            name_symbols()
            result = self._store._load_overload(sig, target_context)
        except Exception:  # a damaged file
            _say_once("damaged", f"compiled code in {self._path} is damaged and is compiled again")
            result = None
            self._attempt(self._store.flush)
        if result is None:
            _say_that_it_compiles(self._package)
        return result

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store machine code; a disk error is only reported."""
        self._attempt(lambda: self._store.save_overload(sig, data))

    def _attempt(self, write: Callable[[], None]) -> None:
        try:
            write()
        except OSError as error:
            _say_once("full", f"compiled code cannot be stored in {self._path} ({error.strerror}): {REMEDY}; otherwise "
                "every run compiles it again")  # fmt: skip


@cache
def name_symbols() -> None:
    """Register the symbols that machine code may call with the linker: numba's memory and seeds of Python's hashes."""
    import numba.cpython.hashing  # noqa: F401  # registers the seeds
    from numba.core.registry import cpu_target
    from numba.core.runtime.nrt import rtsys

    rtsys.initialize(cpu_target.target_context)


def _say_that_it_compiles(package: str) -> None:
    folder = _folder(package)
    # Processes of a pool begin together: only one that finds the folder empty reports.
    is_child = multiprocessing.parent_process() is not None
    if package not in DURATION or (is_child and any(folder.path.rglob("*.nbi"))):
        return
    often = "at every run, because no folder for it is writable" if folder.is_temporary else "once for this machine"
    kept = REMEDY if folder.is_temporary else f"stored in {folder.path}"
    takes = f"{DURATION[package]}, longer while the processor is busy"
    _say_once(package, f"compiling the {SUBJECT.get(package, package)} {often}, {takes}; {kept}")


@cache
def _say_once(subject: str, sentence: str) -> None:  # noqa: ARG001  # key of the cache
    log.warning("stickslip: %s", sentence)


@dataclass(frozen=True)
class _Folder:
    """Folder of the compiled code of a package; if `is_temporary`, it is removed at the end of the run."""

    path: Path
    is_temporary: bool


@cache
def _folder(package: str) -> _Folder:
    """Numba's folder if the user set one, else the user's cache, else a folder removed at the end of the run."""
    from platformdirs import user_cache_path

    digest = hashlib.sha256(FORMAT)
    for file in sorted(file for item in (package, *CALLS.get(package, ())) for file in (ROOT / item).rglob("*.py")):
        code = file.read_bytes()
        if any(mark in code for mark in MARKS):
            digest.update(code)
    named = os.environ.get("NUMBA_CACHE_DIR")
    folder = Path(named) if named else user_cache_path("stickslip", appauthor=False) / "compiled"
    try:
        folder = folder / digest.hexdigest()[:16]
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return _Folder(folder, is_temporary=False)
    except OSError:
        folder = Path(_passing_folder()) / digest.hexdigest()[:16]
        folder.mkdir(exist_ok=True)
        return _Folder(folder, is_temporary=True)


def _passing_folder() -> str:
    """Temporary folder of this process and its child processes."""
    if TEMPORARY_FOLDER not in os.environ:
        owner, folder = os.getpid(), tempfile.mkdtemp(prefix="stickslip-compiled-")
        os.environ[TEMPORARY_FOLDER] = folder
        # Forked processes inherit the exit function, but must not remove the folder.
        atexit.register(lambda: shutil.rmtree(folder, ignore_errors=True) if os.getpid() == owner else None)
    return os.environ[TEMPORARY_FOLDER]
