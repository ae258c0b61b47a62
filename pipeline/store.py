"""Results of stages, kept by what they depend on, so that a second run is instant and an interrupted one goes on.

A stage is a function with a name; its result depends on the code of its module and of all that this imports::

    @stage("blade mesh")
    def blade_mesh(blade: Blade, n: int) -> Mesh: ...

    mesh = store.run(blade_mesh, blade, n=3)

Its result is looked up by a hash over the stage's name, its inputs and its code (`pipeline.fingerprint`): an edited
comment recomputes nothing, an edited formula all that depends on it. Each entry is a folder of files::

    objects/ab/abcdef.../entry.json      stage, seconds, checksum of each file
                         tree.json, arrays.npz, ...

It is written under another name and then renamed: at any moment, after any crash and with any number of processes, an
entry is complete or absent. An entry that was damaged later is found by its checksums: that is told in a sentence, the
entry is removed, and it is computed again like any that was never there.
"""

import contextlib
import errno
import hashlib
import inspect
import json
import os
import shutil
import socket
import tempfile
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Generic, ParamSpec, TypeVar

from pipeline import fingerprint
from pipeline.codec import NPZ, Codec

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")

# What a crash leaves behind is removed after this time; no stage writes its result for longer.
LEFTOVER_AGE = 24 * 3600.0  # s

# Backup programs leave folders with this file alone (bford.info/cachedir).
CACHE_TAG = "Signature: 8a477f597d28d172789f06886806bc55\n# Results of stickslip, which can be computed again.\n"


@dataclass(frozen=True)
class Stage(Generic[P, R]):
    """A function whose results are kept; made by `stage`.

    Parameters
    ----------
    name
        Shown to the user, and part of the key.
    compute
        The function.
    codec
        How the result is saved.
    ignore
        Parameters that do not change the result, such as a progress callback.
    """

    name: str
    compute: Callable[P, R]
    codec: Codec
    ignore: frozenset[str]

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        """Compute without looking anything up."""
        return self.compute(*args, **kwargs)

    def key(self, *args: P.args, **kwargs: P.kwargs) -> str:
        """Where the result for these inputs is kept, as hexadecimal."""
        bound = inspect.signature(self.compute).bind(*args, **kwargs)
        bound.apply_defaults()
        inputs = {name: value for name, value in bound.arguments.items() if name not in self.ignore}
        return fingerprint.key(self.name, inputs, self.compute.__module__)


def stage(name: str, *, codec: Codec = NPZ, ignore: tuple[str, ...] = ()) -> Callable[[Callable[P, R]], Stage[P, R]]:
    """Make a function a stage; see `Stage` for the parameters."""

    def wrap(compute: Callable[P, R]) -> Stage[P, R]:
        unknown = set(ignore) - set(inspect.signature(compute).parameters)
        if unknown:
            raise TypeError(f"stage {name!r} ignores {sorted(unknown)}, which are none of its parameters")
        return Stage(name=name, compute=compute, codec=codec, ignore=frozenset(ignore))

    return wrap


@dataclass(frozen=True, kw_only=True)
class Outcome(Generic[R]):
    """A stage's result and what it cost.

    Parameters
    ----------
    value
        The result.
    seconds
        Wall-clock time that it took when it was computed, now or then [s].
    cached
        Whether it was found.
    """

    value: R
    seconds: float
    cached: bool


class Store:
    """A folder of results; with no folder nothing is kept and everything is computed.

    Parameters
    ----------
    folder
        Created if need be. One that cannot be written is given up with one warning.
    warn
        Receives that warning, and one for each damaged result; one sentence each.
    """

    def __init__(self, folder: Path | None, warn: Callable[[str], None] = warnings.warn) -> None:
        self.folder = folder
        self._warn = warn
        self._told: set[Path] = set()
        if folder is not None:
            try:
                self._prepare(folder)
            except OSError as error:
                self._give_up(error)

    def run(self, stage: Stage[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """Result of a stage, looked up or computed."""
        return self.outcome(stage, *args, **kwargs).value

    def outcome(self, stage: Stage[P, R], *args: P.args, **kwargs: P.kwargs) -> Outcome[R]:
        """Result of a stage with the time that it took, looked up or computed."""
        return self.outcome_within(contextlib.nullcontext, stage, *args, **kwargs)

    def outcome_within(
        self,
        computing: Callable[[], contextlib.AbstractContextManager[object]],
        stage: Stage[P, R],
        *args: P.args,
        **kwargs: P.kwargs,
    ) -> Outcome[R]:
        """The same, computed within a context that is not entered for a result that is found."""
        if self.folder is None:
            with computing():
                return _timed(stage, *args, **kwargs)
        key = stage.key(*args, **kwargs)
        found = self._looked_up(partial(_read, stage=stage), stage.name, key)
        if found is not None:
            return found
        with computing():
            outcome = _timed(stage, *args, **kwargs)
        try:
            self._write(self._entry(self.folder, key), stage, outcome)
        except OSError as error:  # such as a full disk: the result itself is sound
            self._give_up(error)
        return outcome

    def kept(self, stage: Stage[P, R], *args: P.args, **kwargs: P.kwargs) -> Outcome[R] | None:
        """Result of a stage if it is there and sound; it is not computed."""
        if self.folder is None:
            return None
        return self._looked_up(partial(_read, stage=stage), stage.name, stage.key(*args, **kwargs))

    def holds(self, stage: Stage[P, R], *args: P.args, **kwargs: P.kwargs) -> bool:
        """Whether a result is there with all its files as they were written, by their checksums."""
        if self.folder is None:
            return False
        return self._looked_up(_intact, stage.name, stage.key(*args, **kwargs)) is not None

    def size(self) -> tuple[int, int]:
        """Number of results, and what they take together [bytes]."""
        if self.folder is None:
            return 0, 0
        count = size = 0
        for file in (self.folder / "objects").rglob("*"):
            with contextlib.suppress(FileNotFoundError):  # removed by another process meanwhile
                size += file.stat().st_size if file.is_file() else 0
                count += file.name == "entry.json"
        return count, size

    def clear(self) -> None:
        """Remove all results, and nothing else that may be in the folder."""
        if self.folder is not None:
            shutil.rmtree(self.folder / "objects", ignore_errors=True)
            shutil.rmtree(self.folder / "unfinished", ignore_errors=True)
            self._prepare(self.folder)

    @staticmethod
    def _prepare(folder: Path) -> None:
        unfinished = folder / "unfinished"
        unfinished.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=unfinished):
            pass
        tag = folder / "CACHEDIR.TAG"
        if not tag.exists():
            tag.write_text(CACHE_TAG, encoding="ascii")
        for leftover in unfinished.iterdir():
            try:
                if time.time() - leftover.stat().st_mtime > LEFTOVER_AGE:
                    shutil.rmtree(leftover, ignore_errors=True)
            except FileNotFoundError:
                continue  # another process was quicker

    @staticmethod
    def _entry(folder: Path, key: str) -> Path:
        return folder / "objects" / key[:2] / key

    def _looked_up(self, read: Callable[[Path], T | None], name: str, key: str) -> T | None:
        """What is read of an entry; of one that is there and cannot be read this is told, once.

        It stays until a new result takes its place: a disk that fails for a moment makes no sound result a bad one.
        """
        assert self.folder is not None
        entry = self._entry(self.folder, key)
        there = entry.exists()  # asked first: another process may put it there meanwhile
        found = read(entry)
        if there and found is None and entry not in self._told:
            self._told.add(entry)
            self._warn(f"a kept result is damaged and will be computed again: {name} in {entry}")
        return found

    def _write(self, entry: Path, stage: Stage[P, R], outcome: Outcome[R]) -> None:
        assert self.folder is not None
        prefix = f"{entry.name[:12]}-{socket.gethostname()}-{os.getpid()}-"
        draft = Path(tempfile.mkdtemp(prefix=prefix, dir=self.folder / "unfinished"))
        try:
            stage.codec.save(outcome.value, draft)
            checksums = {
                str(file.relative_to(draft)): _checksum(file) for file in sorted(draft.rglob("*")) if file.is_file()
            }
            description = {"stage": stage.name, "seconds": outcome.seconds, "files": checksums}
            (draft / "entry.json").write_text(json.dumps(description), encoding="utf-8")
            entry.parent.mkdir(parents=True, exist_ok=True)
            _replace_folder(draft, entry)
        finally:
            shutil.rmtree(draft, ignore_errors=True)

    def _give_up(self, error: OSError) -> None:
        self._warn(f"the cache {self.folder} cannot be written ({error.strerror}): going on without it")
        self.folder = None


def default_folder() -> Path:
    """Cache folder of this user: ``STICKSLIP_CACHE`` if it is set, else where the system keeps caches."""
    named = os.environ.get("STICKSLIP_CACHE")
    if named:
        return Path(named).expanduser()
    from platformdirs import user_cache_path

    return user_cache_path("stickslip", appauthor=False)


def _timed(stage: Stage[P, R], *args: P.args, **kwargs: P.kwargs) -> Outcome[R]:
    start = time.perf_counter()
    value = stage(*args, **kwargs)
    return Outcome(value=value, seconds=time.perf_counter() - start, cached=False)


def _intact(entry: Path) -> dict[str, Any] | None:
    """Description of an entry whose files are all as they were written; None if it is absent or damaged."""
    try:
        description: dict[str, Any] = json.loads((entry / "entry.json").read_text(encoding="utf-8"))
        sound = all(_checksum(entry / name) == checksum for name, checksum in description["files"].items())
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return None
    return description if sound else None


def _read(entry: Path, stage: Stage[P, R]) -> Outcome[R] | None:
    """An entry's value, or None if it is absent or damaged."""
    description = _intact(entry)
    if description is None:
        return None
    try:
        value: R = stage.codec.load(entry)
        return Outcome(value=value, seconds=float(description["seconds"]), cached=True)
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return None


def _replace_folder(draft: Path, entry: Path) -> None:
    """Rename a folder to where a damaged one, or an equal one of a quicker process, may already be."""
    for attempt in range(10):
        if _intact(entry) is not None:
            return
        try:
            draft.rename(entry)
        except OSError as error:
            if error.errno not in {errno.ENOTEMPTY, errno.EEXIST}:
                raise
            # Only an empty folder can be renamed over, so the damaged one is moved aside, under a name of our own.
            aside = draft.with_name(f"{draft.name}-old{attempt}")
            with contextlib.suppress(FileNotFoundError):
                entry.rename(aside)
            shutil.rmtree(aside, ignore_errors=True)


def _checksum(file: Path) -> str:
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
