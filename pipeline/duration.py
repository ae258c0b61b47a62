"""How long steps take: remembered from run to run, and written as a person reads it."""

import contextlib
import warnings
from collections.abc import Callable
from pathlib import Path

from pipeline.checkpoint import Checkpoint

#: A step shorter than this is not worth a line [s].
WORTH_SHOWING = 1.0


class Durations:
    """How long each step took last time, as a record in the cache.

    Parameters
    ----------
    file
        Its place; None remembers nothing beyond this process.
    warn
        Receives one sentence about a damaged record.
    """

    def __init__(self, file: Path | None = None, warn: Callable[[str], None] = warnings.warn) -> None:
        self._checkpoint = None if file is None else Checkpoint(file, "durations", warn)
        self._seconds: dict[str, float] = (self._checkpoint.load() if self._checkpoint else None) or {}

    def expected(self, name: str) -> float | None:
        """Seconds of the last time, None for a step not seen before."""
        return self._seconds.get(name)

    def remember(self, name: str, seconds: float) -> None:
        """Store for the next run, if the step was worth showing."""
        if seconds < WORTH_SHOWING:
            return
        self._seconds[name] = round(seconds, 1)
        if self._checkpoint is not None:
            with contextlib.suppress(OSError):  # only an estimate
                self._checkpoint.save(self._seconds)


def format_duration(seconds: float) -> str:
    """Time as a person writes it: ``3.2 s``, ``48 s``, ``2 min 05 s``, ``1 h 02 min``."""
    if seconds < 10:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    minutes, rest = divmod(whole, 60)
    if minutes < 60:
        return f"{minutes} min {rest:02d} s"
    return f"{minutes // 60} h {minutes % 60:02d} min"
