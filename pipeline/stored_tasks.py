"""Results of the tasks of one long computation, each in a file as soon as it is there."""

import hashlib
import shutil
from collections.abc import Iterator, MutableMapping
from pathlib import Path
from typing import Any

from pipeline.checkpoint import Checkpoint


class StoredTasks(MutableMapping[str, Any]):
    """A folder with one `Checkpoint` a task.

    A result is always the one that was read back from its file, at once or after a restart: both go on with the same
    bits.

    Parameters
    ----------
    folder
        Created if need be; it belongs to this computation alone.
    key
        Results that were kept under another key are not found.
    """

    def __init__(self, folder: Path, key: str) -> None:
        self.folder = folder
        self.key = key
        self._known: dict[str, Any] = {}
        folder.mkdir(exist_ok=True)

    def __getitem__(self, task: str) -> Any:
        """The result of a task."""
        if task not in self._known:
            found = self._checkpoint(task).load()
            if found is None:
                raise KeyError(task)
            self._known[task] = found
        return self._known[task]

    def __setitem__(self, task: str, result: Any) -> None:
        """Keep a result, which is not None."""
        self._checkpoint(task).save(result)
        self._known.pop(task, None)

    def __delitem__(self, task: str) -> None:
        """Forget a result."""
        self[task]
        del self._known[task]
        self._checkpoint(task).remove()

    def __iter__(self) -> Iterator[str]:
        """Tasks whose results were asked for or kept in this process."""
        return iter(self._known)

    def __len__(self) -> int:
        """Their number."""
        return len(self._known)

    @property
    def n_left(self) -> int:
        """Results under the key that are there, whoever kept them [-]."""
        return sum(Checkpoint(file, self.key).load() is not None for file in self.folder.iterdir())

    def remove(self) -> None:
        """Remove the folder."""
        self._known.clear()
        shutil.rmtree(self.folder, ignore_errors=True)

    def _checkpoint(self, task: str) -> Checkpoint:
        return Checkpoint(self.folder / hashlib.sha256(task.encode()).hexdigest()[:32], self.key)
