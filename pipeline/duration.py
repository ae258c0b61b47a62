"""Durations of steps: stored from run to run, and formatted for readers."""

import contextlib
import warnings
from collections.abc import Callable
from pathlib import Path

from pipeline.checkpoint import Checkpoint

#: Time left is not estimated from less than this share of a step in less than this time [-, s], and never from less
#: than the second share: the first parts of a step compile, read, and differ from the rest.
EARLY, SOON, FIRST = 0.02, 60.0, 0.002
#: Largest number of remembered steps.
MAX_STEPS = 1000
#: A shorter step is not shown [s].
WORTH_SHOWING = 1.0


class Durations:
    """Durations of the last run of each step, as a record in the cache.

    Parameters
    ----------
    file
        Path of the record; None keeps the durations in this process only.
    warn
        Receives one sentence about a damaged record.
    place
        Place of the run, such as its output: the duration of a step depends on the case.
    """

    def __init__(self, file: Path | None = None, warn: Callable[[str], None] = warnings.warn, place: str = "") -> None:
        self._place = place
        self._checkpoint = None if file is None else Checkpoint(file, "durations", warn)
        self._seconds: dict[str, float] = (self._checkpoint.load() if self._checkpoint else None) or {}

    def expected(self, name: str) -> float | None:
        """Last duration [s]; None for an unknown step."""
        return self._seconds.get(f"{self._place}:{name}")

    def remember(self, name: str, seconds: float) -> None:
        """Store for the next run, if the step was long enough to show."""
        if seconds < WORTH_SHOWING:
            return
        key = f"{self._place}:{name}"
        others = [item for item in self._seconds.items() if item[0] != key]
        self._seconds = {**dict(others[-MAX_STEPS:]), key: round(seconds, 1)}
        if self._checkpoint is not None:
            with contextlib.suppress(OSError):  # only an estimate
                self._checkpoint.save(self._seconds)


def extrapolate(done: float, total: float, seconds: float) -> float | None:
    """Time left of a step from its finished share and elapsed time [s]; None while it cannot be estimated."""
    if not FIRST * total <= done < total or (done < EARLY * total and seconds < SOON):
        return None
    return seconds * (total - done) / done


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
