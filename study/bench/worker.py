"""Control of the worker process by the server: start, call, end."""

import contextlib
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Mapping
from typing import Any

from study.bench.work import BenchFiles, serve_calls

#: Longest wait for the end of a process after a signal [s].
PATIENCE = 1.0


class Worker:
    """Process that runs one call after another; the first call starts it.

    Parameters
    ----------
    place
        Case, campaign and store.
    receive
        Function that receives messages, in a separate thread; `{"kind": "ended"}` after an unexpected end.
    """

    def __init__(self, place: BenchFiles, receive: Callable[[Mapping[str, Any]], None]) -> None:
        self._place, self._receive = place, receive
        self._process: multiprocessing.process.BaseProcess | None = None
        self._connection: Any = None

    def call(self, number: int, name: str, arguments: Mapping[str, Any]) -> None:
        """Request a call of the bench; its messages have the number."""
        if self._process is None or not self._process.is_alive():
            self._start()
        self._connection.send({"number": number, "name": name, "arguments": dict(arguments)})

    def end(self) -> None:
        """End the process and all processes that it started; stored results are complete at any time."""
        process, self._process = self._process, None
        if process is None or process.pid is None:
            return
        for number in (signal.SIGTERM, signal.SIGKILL):
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(process.pid, number)
            process.join(PATIENCE)
            if not process.is_alive():
                break
            process.kill()
        self._connection.close()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=serve_calls, args=(theirs, self._place, os.getpid()), daemon=False)
        self._process.start()
        theirs.close()
        threading.Thread(target=self._listen, args=(self._connection, self._process), daemon=True).start()

    def _listen(self, connection: Any, process: multiprocessing.process.BaseProcess) -> None:
        while True:
            try:
                message = connection.recv()
            except (EOFError, OSError):
                break
            if self._process is process:
                self._receive(message)
        if self._process is process:  # not ended by `end`
            self._process = None
            self._receive({"kind": "ended"})
