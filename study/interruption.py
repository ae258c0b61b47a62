"""Ctrl-C and SIGTERM end a command in the same way, wherever in Python or in compiled code they arrive.

Python raises `KeyboardInterrupt` where it happens to be, and that may be a callback of compiled code or the import of
a compiled module, which swallow it or turn it into another error. So a signal is remembered, and raised again until it
has come through. Compiled code that makes named tuples of its results does not notice an error in one within another,
and crashes: there the signal waits for the next line of Python. At the end of the process Python would take down
libraries in the state that the signal left them in, which may crash: an interrupted process ends without.
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

#: Until a signal that was swallowed is raised again: where Python says so, and where it does not [s].
SOON, LATER = 0.05, 10.0
#: Modules whose Python runs while compiled code makes named tuples of its results.
RESULTS = ("namedtuple_", "numba.core.serialize")


class Interrupted(KeyboardInterrupt):
    """A signal; Python ends a process by SIGINT, after all is done, if an exact KeyboardInterrupt has passed `exec`."""


class Interruption:
    """Whether a signal has come."""

    def __init__(self) -> None:
        self.has_come = False

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Raise `Interrupted` within when Ctrl-C is pressed or a batch system ends the job."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        # A shell has its background jobs ignore Ctrl-C.
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
    """The innermost frame that does not belong to the making of a result of compiled code."""
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
    """End without taking libraries down; what is to be done at the end is done, and what was printed is written."""
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    os._exit(exit_code)
