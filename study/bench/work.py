"""Code of the worker process: it runs calls of the bench, and sends progress, results and failures as messages."""

import os
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from geometry.errors import ComputationFailed, InputError
from pipeline.duration import Durations
from pipeline.output import describe_system_failure
from pipeline.progress import Report
from study import console
from study.json_value import to_json

#: Shortest time between two messages of progress [s].
EVERY = 0.25
#: Interval of checks that the server still runs [s].
LOOK_EVERY = 1.0
#: Calls of `study.bench.bench.Bench` that a page may request.
CALLS = frozenset({"compare", "screen", "diagnose", "add", "undo", "calibrate", "save_effect", "move", "limits"})

Send = Callable[[Mapping[str, Any]], None]


@dataclass(frozen=True, kw_only=True)
class BenchFiles:
    """Input of a worker.

    Parameters
    ----------
    case, folder, without
        See `study.bench.bench.Bench`.
    cache
        Folder of stored results.
    trust
        Whether ``--trust`` was given.
    """

    case: Path
    folder: Path
    without: tuple[str, ...] = ()
    cache: Path | None = None
    trust: bool = False


def serve_calls(connection: Connection, place: BenchFiles, parent: int) -> None:
    """Run calls until the connection is closed; the process ends with its server."""
    os.setsid()  # Only the server handles Ctrl-C; it also ends the processes that this worker starts.
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    lock = threading.Lock()

    def send(message: Mapping[str, Any]) -> None:
        with lock:
            connection.send(to_json(message))

    bench: Any = None
    while True:
        try:
            call = connection.recv()
        except EOFError:
            return
        try:
            bench = bench or _open(place, send)
            result = getattr(bench, call["name"])(**call["arguments"])
            message = {"kind": "done", "numbers": result.numbers, "views": result.views}
        except Exception as error:
            message = {"kind": "failed", "sentence": describe(error, call["name"])}
        send({**message, "name": call["name"], "number": call["number"], "arguments": call["arguments"]})


def describe(error: Exception, name: str) -> str:
    """Describe an error in a sentence for the page."""
    if isinstance(error, InputError | ComputationFailed):
        return str(error)
    if isinstance(error, MemoryError):
        return console.OUT_OF_MEMORY
    if isinstance(error, FileNotFoundError):
        return f"{error.filename} no longer exists: restore it"
    return describe_system_failure(error) or console.report_mistake(error, ["bench", name])


def _open(place: BenchFiles, send: Send) -> Any:
    from pipeline.store import Store
    from study.bench.bench import Bench
    from study.case.trust import trust_code
    from study.run_context import RunContext

    trust_code(place.trust)  # this process does not inherit the setting of its parent

    def warn(sentence: str) -> None:
        send({"kind": "warning", "sentence": sentence})

    store = Store(place.cache, warn)
    durations = Durations(store.folder / "durations.npz" if store.folder else None, warn, str(place.case.resolve()))
    run = RunContext(output=None, store=store, progress=SentProgress(send, durations), json=False, quiet=True)
    return Bench(place.case, place.folder, run, place.without)


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(LOOK_EVERY)
    os._exit(1)


@dataclass
class _Step:
    name: str
    start: float
    expected: float | None
    share: float | None = None

    def document(self, now: float) -> dict[str, Any]:
        share = self.share
        if share is None and self.expected:
            share = min((now - self.start) / self.expected, 0.95)  # not complete before the step ends
        return {"name": self.name, "share": share}


@dataclass
class SentProgress:
    """Progress as messages: the open, nested steps; see `pipeline.progress.Progress`.

    Parameters
    ----------
    send
        Function that sends a message.
    durations
        Durations of steps in earlier runs.
    clock
        Function that returns the time [s]; replaced in tests.
    """

    send: Send
    durations: Durations = field(default_factory=Durations)
    clock: Callable[[], float] = time.monotonic
    _open: list[_Step] = field(default_factory=list)
    _last: float = -EVERY

    @contextmanager
    def step(self, name: str, *, expected: float | None = None) -> Iterator[Report]:
        """A named step; see `pipeline.progress.Progress`."""
        step = _Step(name, self.clock(), self.durations.expected(name) or expected)
        self._open.append(step)
        self._send_progress(at_once=True)

        def report(done: float, total: float) -> None:
            step.share = done / total if total > 0 else None
            self._send_progress()

        try:
            yield report
        finally:
            self._open.remove(step)
        self.durations.remember(name, self.clock() - step.start)
        self._send_progress()

    def stored(self, name: str) -> None:
        """Do nothing, since a stored step takes no time."""

    def _send_progress(self, *, at_once: bool = False) -> None:
        now = self.clock()
        if at_once or now - self._last >= EVERY:
            self._last = now
            self.send({"kind": "progress", "steps": documents(self._open, now)})


def documents(steps: Sequence[_Step], now: float) -> list[dict[str, Any]]:
    """Make the data of steps for the page, the outermost first."""
    return [step.document(now) for step in steps]
