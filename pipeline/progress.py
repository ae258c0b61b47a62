"""Progress with time left: bars on a terminal, occasional lines elsewhere, nothing in quiet mode.

The numerical packages do not depend on this: a long function takes a callback ``report(done, total)`` and calls it
repeatedly. Here the callback belongs to a named step::

    with progress.step("hex20, 3 elements: modes", expected=6.0) as report:
        modes(system, 10, report=report)
"""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from threading import Timer
from typing import TYPE_CHECKING, ParamSpec, Protocol, TextIO, TypeVar

from pipeline.duration import WORTH_SHOWING, Durations, extrapolate, format_duration
from pipeline.store import Stage, Store

if TYPE_CHECKING:
    from rich.progress import Progress as RichBars

P = ParamSpec("P")
R = TypeVar("R")

#: Without a bar, such as in a log file, a step shows its share after this time [s].
LINE_EVERY = 10.0


class Report(Protocol):
    """Callback of a long function; it may raise KeyboardInterrupt, never anything else."""

    def __call__(self, done: float, total: float) -> None:
        """Report the finished and the total amount of work, in any unit."""


class Progress(Protocol):
    """Shows steps, which may lie within each other."""

    def step(self, name: str, *, expected: float | None = None) -> AbstractContextManager[Report]:
        """A named step; without reports, the time left is from its last duration, or `expected` [s]."""

    def stored(self, name: str) -> None:
        """A step whose result was stored in an earlier run."""


class SilentProgress:
    """Shows nothing."""

    @contextmanager
    def step(self, name: str, *, expected: float | None = None) -> Iterator[Report]:
        """Do nothing."""
        del name, expected
        yield lambda _done, _total: None

    def stored(self, name: str) -> None:
        """Do nothing."""


class LineProgress:
    """Plain lines: one when a step takes long, one every ten seconds, one at its end.

    Parameters
    ----------
    stream
        Output stream; standard error by default, so that results can be piped.
    durations
        For steps that report nothing.
    clock
        Seconds; another one in tests.
    """

    def __init__(
        self,
        stream: TextIO | None = None,
        durations: Durations | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._stream = stream or sys.stderr
        self._durations = durations or Durations()
        self._clock = clock
        self._depth = 0

    @contextmanager
    def step(self, name: str, *, expected: float | None = None) -> Iterator[Report]:
        """Show a step; see `Progress`."""
        start = last = self._clock()
        indent = "  " * self._depth
        guess = self._durations.expected(name) or expected
        if guess is not None and guess >= WORTH_SHOWING:
            self._line(f"{indent}{name} ... about {format_duration(guess)}")

        def report(done: float, total: float) -> None:
            nonlocal last
            now = self._clock()
            if total > 0 and now - last >= (LINE_EVERY if last > start else WORTH_SHOWING):
                last = now
                self._line(f"{indent}{name}: {100 * done / total:.0f} %{_format_time_left(done, total, now - start)}")

        self._depth += 1
        try:
            yield report
        finally:
            self._depth -= 1
        seconds = self._clock() - start
        self._durations.remember(name, seconds)
        if seconds >= WORTH_SHOWING:
            self._line(f"{indent}{name}: done in {format_duration(seconds)}")

    def stored(self, name: str) -> None:
        """Show a stored step; see `Progress`."""
        self._line(f"{'  ' * self._depth}{name}: stored")

    def _line(self, text: str) -> None:
        self._stream.write(f"{text}\n")
        self._stream.flush()


class BarProgress:
    """Bars on a terminal; each finished step remains as one line with its duration.

    Parameters
    ----------
    durations
        For steps that report nothing.
    """

    def __init__(self, durations: Durations | None = None) -> None:
        self._durations = durations or Durations()
        self._bars: RichBars | None = None
        self._depth = 0

    @contextmanager
    def step(self, name: str, *, expected: float | None = None) -> Iterator[Report]:
        """Show a step; see `Progress`."""
        bars = self._bars or self._start()
        guess = self._durations.expected(name) or expected
        label = "  " * self._depth + name
        start = time.monotonic()
        # The bar moves with the clock until the first report, and never to its end.
        task = bars.add_task(label, total=1.0 if guess else None, visible=False, guess=guess)
        reveal = Timer(WORTH_SHOWING, lambda: bars.update(task, visible=True))
        reveal.daemon = True
        reveal.start()

        def report(done: float, total: float) -> None:
            bars.update(task, completed=done, total=total, guess=None)

        self._depth += 1
        finished = False
        try:
            yield report
            finished = True
        finally:
            self._depth -= 1
            reveal.cancel()
            bars.remove_task(task)
            seconds = time.monotonic() - start
            if finished and seconds >= WORTH_SHOWING:
                bars.console.print(f"{label}: {format_duration(seconds)}", style="dim", markup=False, highlight=False)
            if self._depth == 0:
                bars.stop()
                self._bars = None
        self._durations.remember(name, seconds)

    def stored(self, name: str) -> None:
        """Show a stored step; see `Progress`."""
        bars = self._bars or self._start()
        bars.console.print(f"{'  ' * self._depth}{name}: stored", style="dim", markup=False, highlight=False)
        if self._depth == 0:
            bars.stop()
            self._bars = None

    def _start(self) -> "RichBars":
        from pipeline.progress_bar import bars

        self._bars = bars()
        self._bars.start()
        return self._bars


class ShownStep:
    """Progress of a step that consists of one stage: shown while it is computed, or reported as stored.

    Parameters
    ----------
    name
        Shown name.
    store, progress
        Store and progress of the command's run.
    expected
        Expected duration before the first run [s].
    """

    def __init__(self, name: str, store: Store, progress: Progress, expected: float | None = None) -> None:
        self._name = name
        self._store = store
        self._progress = progress
        self._expected = expected
        self._shown: Report | None = None

    def report(self, done: float, total: float) -> None:
        """Callback for a stage that reports its progress."""
        if self._shown is not None:
            self._shown(done, total)

    def run(self, stage: Stage[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """Result of the stage, looked up or computed."""
        outcome = self._store.outcome_in_context(self._computing, stage, *args, **kwargs)
        if outcome.cached:
            self._progress.stored(self._name)
        return outcome.value

    @contextmanager
    def _computing(self) -> Iterator[None]:
        with self._progress.step(self._name, expected=self._expected) as self._shown:
            yield


def _format_time_left(done: float, total: float, seconds: float) -> str:
    left = extrapolate(done, total, seconds)
    return "" if left is None else f", about {format_duration(left)} left"
