"""Ctrl-C and SIGTERM end a command in the same way, whether Python or compiled code runs.

Python raises `KeyboardInterrupt` at the current line. In a callback of compiled code, or during the import of a
compiled module, the exception may be swallowed or replaced by another error; the signal is therefore recorded and
raised again until it has an effect. Compiled code that returns nested named tuples does not check for an error in an
inner one, and crashes: there the exception is raised at the next line of Python outside. The teardown of libraries that
were interrupted may crash too: an interrupted process ends without it.
"""

import atexit
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NoReturn

#: Delay until a swallowed signal is raised again: if Python reports that it was swallowed, and otherwise [s].
SOON, LATER = 0.05, 10.0
#: Modules whose Python code runs while compiled code makes named tuples of its results.
RESULTS = ("namedtuple_", "numba.core.serialize")


class Interrupted(KeyboardInterrupt):
    """An interrupting signal; after an exact KeyboardInterrupt from `exec`, Python would end the process by SIGINT."""


class Interruption:
    """Handler of interrupting signals, and whether a signal has come."""

    def __init__(self) -> None:
        self.has_come = False

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Raise `Interrupted` within this context when Ctrl-C is pressed or a batch system ends the job."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        # A shell lets its background jobs ignore Ctrl-C.
        wanted = [signal.SIGTERM, signal.SIGALRM]
        if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
            wanted.append(signal.SIGINT)
        before, hook = {number: signal.signal(number, self._raise) for number in wanted}, sys.unraisablehook
        sys.unraisablehook = self._swallowed
        try:
            yield
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)
            sys.unraisablehook = hook
            for number, handler in before.items():
                signal.signal(number, handler)

    def _raise(self, _number: int, frame: FrameType | None) -> None:
        self.has_come = True
        signal.setitimer(signal.ITIMER_REAL, LATER)
        outside = _find_frame_outside_results(frame)
        if outside is None or outside is frame:
            raise Interrupted
        # Python calls the trace function of a frame at its next line, if tracing is on at all.
        outside.f_trace = _interrupt
        sys.settrace(lambda *_: None)

    @staticmethod
    def _swallowed(unraisable: "sys.UnraisableHookArgs") -> None:
        if issubclass(unraisable.exc_type, Interrupted):
            signal.setitimer(signal.ITIMER_REAL, SOON)
        else:
            sys.__unraisablehook__(unraisable)


def _find_frame_outside_results(frame: FrameType | None) -> FrameType | None:
    """Return the innermost frame outside the code that makes a result of compiled code."""
    outside = above = frame
    while above is not None:
        name, above = str(above.f_globals.get("__name__")), above.f_back
        if name.startswith(RESULTS):
            outside = above
    return outside


def _interrupt(_frame: FrameType, _event: str, _argument: object) -> NoReturn:
    sys.settrace(None)
    raise Interrupted


def end_process(exit_code: int) -> NoReturn:
    """End the process without teardown of libraries, after the exit functions, with all output flushed."""
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    os._exit(exit_code)
