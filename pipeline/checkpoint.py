"""The state of an unfinished computation as one file, so that the same command goes on where it was stopped."""

import contextlib
import io
import tempfile
import time
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pipeline.codec import NPZ, Codec
from pipeline.output import replace_file

KEY = "key"
#: Saving may take this share of the time at most, however much there is to save.
SHARE = 0.05


class Checkpoint:
    """A file that holds one value and the key of the inputs and code that it belongs to.

    It is replaced in one step: whatever happens, it holds one value whole, or another, or none.

    Parameters
    ----------
    file
        In an existing folder.
    key
        A value that was saved under another key is not found.
    every
        `offer` saves when so much time has passed, or more where saving itself takes long [s].
    clock
        Seconds; another one in tests.
    """

    def __init__(
        self,
        file: Path,
        key: str,
        *,
        every: float = 1.0,
        codec: Codec = NPZ,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.file = file
        self.key = key
        self._every = every
        self._codec = codec
        self._clock = clock
        self._last = clock()
        self._cost = 0.0

    def load(self) -> Any:
        """The value; None if there is none, it belongs to something else, or the file is damaged."""
        try:
            with zipfile.ZipFile(self.file) as archive, tempfile.TemporaryDirectory() as folder:
                if archive.read(KEY).decode() != self.key:
                    return None
                archive.extractall(folder)
                return self._codec.load(Path(folder))
        except (OSError, ValueError, LookupError, TypeError, AttributeError, zipfile.BadZipFile):
            return None

    def save(self, value: Any) -> None:
        """Save a value in place of the one before."""
        begin = self._clock()
        stream = io.BytesIO()
        with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(stream, "w") as archive:
            self._codec.save(value, Path(folder))
            archive.writestr(KEY, self.key)
            for file in sorted(Path(folder).iterdir()):
                archive.write(file, file.name)
        replace_file(self.file, stream.getvalue())
        self._last = self._clock()
        self._cost = self._last - begin

    def offer(self, value: Any) -> None:
        """Save a value if the last one is old enough."""
        if self._clock() - self._last >= max(self._every, self._cost / SHARE):
            self.save(value)

    def remove(self) -> None:
        """Remove the file, if there is one."""
        with contextlib.suppress(FileNotFoundError):
            self.file.unlink()
