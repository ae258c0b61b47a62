"""Checkpoints of an unfinished computation, from which the same command continues."""

import hashlib
import shutil
import time
import warnings
from collections.abc import Callable, Iterator, MutableMapping
from pathlib import Path
from typing import Any

from pipeline.record import DamagedRecord, Record, read_record, write_record

#: Largest share of the time for saving, whatever the amount of data.
MAX_SAVING_SHARE = 0.05


class Checkpoint:
    """One record (`pipeline.record`) that is replaced as the work proceeds.

    Parameters
    ----------
    file
        Path of the record, in an existing folder.
    key
        Hash of the inputs and the code; a value saved under another key is ignored.
    warn
        Receives one sentence about a damaged record.
    every
        Interval of `save_if_due`, longer if saving itself takes long [s].
    clock
        Seconds; another one in tests.
    """

    def __init__(
        self,
        file: Path,
        key: str,
        warn: Callable[[str], None] = warnings.warn,
        *,
        every: float = 1.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.file, self.key = file, key
        self._warn, self._every, self._clock = warn, every, clock
        self._last, self._cost = clock(), 0.0

    def load(self) -> Any:
        """The value; None if it is absent, has another key, or its record is damaged."""
        try:
            record = read_record(self.file)
        except DamagedRecord:
            self._warn(f"{self.file} is damaged; its content will be computed again")
            return None
        return record.value if record is not None and record.key == self.key else None

    def save(self, value: Any) -> None:
        """Save a value; it replaces the previous one."""
        begin = self._clock()
        write_record(self.file, Record(value=value, key=self.key))
        self._last = self._clock()
        self._cost = self._last - begin

    def save_if_due(self, value: Any) -> None:
        """Save a value if enough time has passed since the last one."""
        if self._clock() - self._last >= max(self._every, self._cost / MAX_SAVING_SHARE):
            self.save(value)

    def remove(self) -> None:
        """Remove the file, if there is one."""
        self.file.unlink(missing_ok=True)


class StoredTasks(MutableMapping[str, Any]):
    """Results of the tasks of one long computation: a folder with one checkpoint per task.

    A result is always read back from its file, at once or after a restart, so that both continue with the same bits. It
    remains known if the file is removed.

    Parameters
    ----------
    folder
        Created if need be; it belongs to this computation alone.
    key
        Results stored under another key are ignored.
    warn
        Receives one sentence about each damaged record.
    """

    def __init__(self, folder: Path, key: str, warn: Callable[[str], None] = warnings.warn) -> None:
        self.folder, self.key, self._warn = folder, key, warn
        self._known: dict[str, Any] = {}
        folder.mkdir(exist_ok=True)

    def __getitem__(self, task: str) -> Any:
        """The result of a task."""
        if task not in self._known:
            value = self._checkpoint(task).load()
            if value is None:
                raise KeyError(task)
            self._known[task] = value
        return self._known[task]

    def __setitem__(self, task: str, result: Any) -> None:
        """Store a result, which is not None."""
        checkpoint = self._checkpoint(task)
        try:
            self.folder.mkdir(exist_ok=True)
            checkpoint.save(result)
            stored = checkpoint.load()
        except FileNotFoundError:
            stored = None  # another process with the same folder is done, and has removed it
        self._known[task] = result if stored is None else stored

    def __delitem__(self, task: str) -> None:
        """Forget a result."""
        self[task]
        del self._known[task]
        self._checkpoint(task).remove()

    def __iter__(self) -> Iterator[str]:
        """Tasks whose results were requested in this process."""
        return iter(self._known)

    def __len__(self) -> int:
        """Number of results known to this process."""
        return len(self._known)

    @property
    def n_left(self) -> int:
        """Number of existing results under the key, from any process [-]."""
        files = (Checkpoint(file, self.key, warn=lambda _: None) for file in self.folder.iterdir())
        return sum(file.load() is not None for file in files)

    def remove(self) -> None:
        """Remove the folder."""
        self._known.clear()
        shutil.rmtree(self.folder, ignore_errors=True)

    def _checkpoint(self, task: str) -> Checkpoint:
        return Checkpoint(self.folder / hashlib.sha256(task.encode()).hexdigest()[:32], self.key, self._warn)
