"""How long steps take: remembered from run to run, and written as a person reads it."""

import json
from pathlib import Path

from pipeline.output import replace_file

# A step shorter than this is not worth a line.
WORTH_SHOWING = 1.0  # s


class Durations:
    """How long each step took last time, in a file of the cache.

    Parameters
    ----------
    file
        JSON, step name to seconds; None remembers nothing beyond this process.
    """

    def __init__(self, file: Path | None = None) -> None:
        self._file = file
        self._seconds: dict[str, float] = {}
        if file is not None:
            try:
                known = json.loads(file.read_text(encoding="utf-8"))
                self._seconds = {str(name): float(seconds) for name, seconds in known.items()}
            except (OSError, ValueError, AttributeError, TypeError):
                self._seconds = {}  # an estimate, not worth a word

    def expected(self, name: str) -> float | None:
        """Seconds of the last time, None for a step not seen before."""
        return self._seconds.get(name)

    def remember(self, name: str, seconds: float) -> None:
        """Keep for the next run, if the step was worth showing."""
        if seconds < WORTH_SHOWING:
            return
        self._seconds[name] = round(seconds, 1)
        if self._file is not None and self._file.parent.is_dir():
            try:
                replace_file(self._file, json.dumps(self._seconds))
            except OSError:
                self._file = None


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
