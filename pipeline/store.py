"""Results of stages, stored by a hash of their inputs: a second run is instant, and an interrupted one continues.

A stage is a function with a name; its result depends on the code of its module and of all its imports::

    @stage("blade mesh")
    def blade_mesh(blade: Blade, n: int) -> Mesh: ...

    mesh = store.run(blade_mesh, blade, n=3)

Its result is looked up by a hash over the stage's name, its inputs and its code (`pipeline.fingerprint`): an edited
comment recomputes nothing, an edited formula all results that depend on it. Each result is a separate file, a record
(`pipeline.record`), which is complete or absent: ``objects/ab/abcdef....npz``. A result that was damaged later is
detected, reported in a sentence, and computed again.
"""

import contextlib
import inspect
import shutil
import tempfile
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, ParamSpec, TypeVar

from pipeline import fingerprint
from pipeline.record import DamagedRecord, Record, is_intact, read_record, write_record

P = ParamSpec("P")
R = TypeVar("R")

#: Remains of a crash are removed after this time; no stage takes longer to write its result [s].
LEFTOVER_AGE = 24 * 3600.0
#: Backup programs skip folders with this file (bford.info/cachedir).
CACHE_TAG = "Signature: 8a477f597d28d172789f06886806bc55\n# Results of stickslip, which can be computed again.\n"


@dataclass(frozen=True)
class Stage(Generic[P, R]):
    """A function whose results are stored; made by `stage`.

    Parameters
    ----------
    name
        Shown to the user, and part of the key.
    compute
        The function.
    ignore
        Parameters that do not change the result, such as a progress callback.
    """

    name: str
    compute: Callable[P, R]
    ignore: frozenset[str]

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        """Compute without using the store."""
        return self.compute(*args, **kwargs)

    def key(self, *args: P.args, **kwargs: P.kwargs) -> str:
        """Name of the result for these inputs, as hexadecimal."""
        bound = inspect.signature(self.compute).bind(*args, **kwargs)
        bound.apply_defaults()
        inputs = {name: value for name, value in bound.arguments.items() if name not in self.ignore}
        return fingerprint.key(self.name, inputs, self.compute.__module__)


def stage(name: str, *, ignore: tuple[str, ...] = ()) -> Callable[[Callable[P, R]], Stage[P, R]]:
    """Make a function a stage; see `Stage` for the parameters."""

    def wrap(compute: Callable[P, R]) -> Stage[P, R]:
        unknown = set(ignore) - set(inspect.signature(compute).parameters)
        if unknown:
            raise TypeError(f"stage {name!r} ignores {sorted(unknown)}, which are not its parameters")
        return Stage(name=name, compute=compute, ignore=frozenset(ignore))

    return wrap


@dataclass(frozen=True, kw_only=True)
class Outcome(Generic[R]):
    """A stage's result and its computing time.

    Parameters
    ----------
    value
        The result.
    seconds
        Wall-clock time of its computation, now or in an earlier run [s].
    cached
        Whether it was stored.
    """

    value: R
    seconds: float
    cached: bool


class Store:
    """A folder of results; without a folder nothing is stored and everything is computed.

    Parameters
    ----------
    folder
        Created if necessary. If it cannot be written, it is not used, with one warning.
    warn
        Receives this warning, and one for each damaged result; one sentence each.
    """

    def __init__(self, folder: Path | None, warn: Callable[[str], None] = warnings.warn) -> None:
        self.folder = folder
        self._warn = warn
        self._reported: set[Path] = set()
        if folder is not None:
            try:
                self._prepare(folder)
            except OSError as error:
                self._disable_cache(error)

    def run(self, stage: Stage[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """Result of a stage, looked up or computed."""
        return self.outcome(stage, *args, **kwargs).value

    def outcome(self, stage: Stage[P, R], *args: P.args, **kwargs: P.kwargs) -> Outcome[R]:
        """Result of a stage with its computing time, looked up or computed."""
        return self.outcome_in_context(contextlib.nullcontext, stage, *args, **kwargs)

    def outcome_in_context(
        self,
        computing: Callable[[], contextlib.AbstractContextManager[object]],
        stage: Stage[P, R],
        *args: P.args,
        **kwargs: P.kwargs,
    ) -> Outcome[R]:
        """`outcome` with a context for the computation, which is not entered for a stored result."""
        file = self._file(stage, *args, **kwargs)
        known = self._read(stage, file)
        if known is not None:
            return known
        with computing():
            start = time.perf_counter()
            value = stage(*args, **kwargs)
            outcome = Outcome(value=value, seconds=time.perf_counter() - start, cached=False)
        if file is not None:
            self._write(stage, file, outcome)
        return outcome

    def look_up(self, stage: Stage[P, R], *args: P.args, **kwargs: P.kwargs) -> Outcome[R] | None:
        """Stored result of a stage; None without an intact one. Nothing is computed."""
        return self._read(stage, self._file(stage, *args, **kwargs))

    def keep(self, outcome: Outcome[R], stage: Stage[P, R], *args: P.args, **kwargs: P.kwargs) -> None:
        """Store a result that was computed elsewhere."""
        file = self._file(stage, *args, **kwargs)
        if file is not None:
            self._write(stage, file, outcome)

    def has(self, stage: Stage[P, R], *args: P.args, **kwargs: P.kwargs) -> bool:
        """Whether a result exists with all its bytes as written."""
        file = self._file(stage, *args, **kwargs)
        there = file is not None and file.exists()  # asked first: another process may put it there meanwhile
        intact = file is not None and is_intact(file)
        if there and not intact:
            self._report_damage(stage, file)
        return intact

    def size(self) -> tuple[int, int]:
        """Number of results, and their total size [bytes]."""
        if self.folder is None:
            return 0, 0
        count = size = 0
        for file in (self.folder / "objects").rglob("*.npz"):
            with contextlib.suppress(FileNotFoundError):  # removed by another process meanwhile
                size += file.stat().st_size
                count += 1
        return count, size

    def clear(self) -> None:
        """Remove all results, but no other content of the folder."""
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
            with contextlib.suppress(OSError):  # another process was quicker
                if time.time() - leftover.stat().st_mtime > LEFTOVER_AGE:
                    leftover.unlink()

    def _file(self, stage: Stage[P, R], *args: P.args, **kwargs: P.kwargs) -> Path | None:
        if self.folder is None:
            return None
        key = stage.key(*args, **kwargs)
        return self.folder / "objects" / key[:2] / f"{key}.npz"

    def _read(self, stage: Stage[P, R], file: Path | None) -> Outcome[R] | None:
        try:
            record = None if file is None else read_record(file)
        except DamagedRecord:
            self._report_damage(stage, file)
            return None
        return None if record is None else Outcome(value=record.value, seconds=record.seconds, cached=True)

    def _write(self, stage: Stage[P, R], file: Path, outcome: Outcome[R]) -> None:
        assert self.folder is not None
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            record = Record(value=outcome.value, name=stage.name, key=file.stem, seconds=outcome.seconds)
            write_record(file, record, drafts=self.folder / "unfinished")
        except OSError as error:  # such as a full disk: the result itself is sound
            self._disable_cache(error)
        except TypeError as error:  # such as an effect from outside that has a function among its values
            self._warn(f"the result of {stage.name} cannot be stored, and will be computed again: {error}")

    def _report_damage(self, stage: Stage[P, R], file: Path | None) -> None:
        """Warn of a damaged file, once for each.

        The file stays until a new result replaces it, because a read error of the disk may be temporary.
        """
        if file is not None and file not in self._reported:
            self._reported.add(file)
            self._warn(f"a stored result is damaged and will be computed again: {stage.name} in {file}")

    def _disable_cache(self, error: OSError) -> None:
        self._warn(f"the cache {self.folder} cannot be written ({error.strerror}): continuing without it")
        self.folder = None
