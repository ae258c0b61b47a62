"""Compiling a function to machine code, stored on disk until any of the compiled code changes.

numba stores compiled functions by the file that holds them, and does not see a change in what they call from another
file. Here they are stored in a folder whose name is a hash over all files of the package that compile or define what
compiled functions exchange, so that stale machine code cannot be found.

Compiling takes up to minutes, once: a line on the logger `stickslip`, which Python writes to standard error unless
the user says otherwise, says so when it begins. Damaged files are compiled again, and a full disk stores nothing.
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

#: A file that holds one of these takes part in compiled code.
MARKS = (b"fe.compiled", b"NamedTuple", b"import intrinsic", b"fe.sparse.simd_code")
#: Changes with the layout of the files.
FORMAT = b"with checksums"
#: How long the compiled code of a package takes, on one core of 2024 that does nothing else, where that is long.
DURATION = {"fe": "about 15 seconds", "hbsolve": "up to a minute", "transient": "about 20 seconds"}
#: What these packages are, for people who have not seen the code.
SUBJECT = {"fe": "finite elements", "hbsolve": "solver", "transient": "time integration"}
#: Where processes of this run find the folder that is removed at its end.
PASSING = "STICKSLIP_PASSING_FOLDER"
#: What the user can do about a folder.
REMEDY = "set NUMBA_CACHE_DIR to a writable folder with about 50 MB of free space"

log = logging.getLogger("stickslip")


ROOT = Path(__file__).parent.parent
#: Packages whose compiled functions another package calls.
CALLS = {"hbsolve": ("reduction",), "transient": ("reduction",), "correlation": ("reduction", "hbsolve")}


def compiled(function: F) -> F:
    """Compile on the first call; without bounds checks, so array shapes are the caller's care."""
    import numba

    package = function.__module__.partition(".")[0]
    machine: Any = numba.njit(error_model="numpy")(function)
    machine._cache = _StoredCode(function, package, _folder(package).path)
    return cast(F, machine)


def compiled_template(function: Callable[..., Any]) -> Callable[..., Any]:
    """What makes compiled copies of a function: in ``make(module, name=other)`` `other` stands for its global `name`.

    numba stores no machine code that is given a function as argument. A copy is stored for the module that asks for it,
    which may have one of each template. What `name` stands for may also be a constant.
    """

    def make(module: str, **others: Any) -> Callable[..., Any]:
        code = function.__code__.replace(co_filename=str(sys.modules[module].__file__))
        copied = FunctionType(code, {**function.__globals__, **others, "__name__": module}, function.__name__)
        return compiled(cast(Callable[..., Any], copied))

    return make


def compiled_switch(
    module: str, arguments: str, cases: Sequence[Callable[..., Any]], other: tuple[Callable[..., Any], str]
) -> Callable[..., Any]:
    """A compiled function that calls one of several: ``switch(kind, address, ...)``.

    numba can choose among functions by their number only where each call is written out, so the source is made here.

    Parameters
    ----------
    module
        Name of the calling module, which the machine code is stored for.
    arguments
        Names of the arguments, separated by commas.
    cases
        Called with these arguments for kind = 0, 1, ...
    other
        Called for any other kind, and the names of its arguments, which may include ``address``.
    """
    lines = [f"def switch(kind, address, {arguments}):"]
    lines += [f"    if kind == {number}:\n        return case_{number}({arguments})" for number in range(len(cases))]
    lines += [f"    return other({other[1]})"]
    scope = {f"case_{number}": case for number, case in enumerate(cases)} | {"other": other[0], "__name__": module}
    exec(compile("\n".join(lines), str(sys.modules[module].__file__), "exec"), scope)
    return compiled(cast(Callable[..., Any], scope["switch"]))


class _StoredCode:
    """numba's store of one function, which may be empty, damaged or full; opened on first use, as most are never used.

    Parameters
    ----------
    function
        Function that is compiled.
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
        """Machine code for arguments of these types; None, which has it compiled, if there is none that can be read."""
        with suppress(ImportError, AttributeError):  # another numba reads all that was stored
            target_context.codegen()._library_class = stored_library_class()
        try:
            # numba's `load_overload` reads all that it knows how to compile before: a tenth of the time of a command
            # that compiles nothing. Its compiler does so again where something must be compiled.
            name_symbols()
            result = self._store._load_overload(sig, target_context)
        except Exception:  # a file that a power cut or a bad disk damaged
            _say_once("damaged", f"compiled code in {self._path} is damaged and is compiled again")
            result = None
            self._attempt(self._store.flush)
        if result is None:
            _say_that_it_compiles(self._package)
        return result

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store machine code, if the disk takes it."""
        self._attempt(lambda: self._store.save_overload(sig, data))

    def _attempt(self, write: Callable[[], None]) -> None:
        try:
            write()
        except OSError as error:
            _say_once("full", f"compiled code cannot be stored in {self._path} ({error.strerror}): {REMEDY}; otherwise "
                "every run compiles it again")  # fmt: skip


@cache
def name_symbols() -> None:
    """Make known to the linker all that machine code may call: numba's memory, and the seeds of Python's hashes."""
    import numba.cpython.hashing  # noqa: F401  # names the seeds
    from numba.core.registry import cpu_target
    from numba.core.runtime.nrt import rtsys

    rtsys.initialize(cpu_target.target_context)


def _say_that_it_compiles(package: str) -> None:
    folder = _folder(package)
    # Processes of a pool begin together: the one that finds the folder empty speaks for all.
    is_child = multiprocessing.parent_process() is not None
    if package not in DURATION or (is_child and any(folder.path.rglob("*.nbi"))):
        return
    often = "at every run, because no folder for it is writable" if folder.passes else "once for this machine"
    kept = REMEDY if folder.passes else f"stored in {folder.path}"
    takes = f"{DURATION[package]}, longer while the processor is busy"
    _say_once(package, f"compiling the {SUBJECT.get(package, package)} {often}, {takes}; {kept}")


@cache
def _say_once(subject: str, sentence: str) -> None:  # noqa: ARG001  # what is said once
    log.warning("stickslip: %s", sentence)


@dataclass(frozen=True)
class _Folder:
    """Where the compiled code of a package is, and whether it ends with this run."""

    path: Path
    passes: bool


@cache
def _folder(package: str) -> _Folder:
    """Numba's folder if the user named one, else the user's cache, else one that is removed at the end of the run."""
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
            return _Folder(folder, passes=False)
    except OSError:
        folder = Path(_passing_folder()) / digest.hexdigest()[:16]
        folder.mkdir(exist_ok=True)
        return _Folder(folder, passes=True)


def _passing_folder() -> str:
    """A folder for this process and those that it starts."""
    if PASSING not in os.environ:
        owner, folder = os.getpid(), tempfile.mkdtemp(prefix="stickslip-compiled-")
        os.environ[PASSING] = folder
        # A forked process inherits what is done at the end, but not the folder.
        atexit.register(lambda: shutil.rmtree(folder, ignore_errors=True) if os.getpid() == owner else None)
    return os.environ[PASSING]
