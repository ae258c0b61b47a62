"""Processor time: a clock for calls that take less than a second, and a time limit for calls that may not end."""

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager


class TimeUp(BaseException):
    """The limit of processor time is reached; a BaseException, so that error handlers do not catch it."""


def processor_time(job: Callable[[], object], repeats: int) -> float:
    """Processor time of one call [s]: the shortest mean of five rounds."""
    rounds = []
    for _ in range(5):
        start = time.process_time()
        for _ in range(repeats):
            job()
        rounds.append((time.process_time() - start) / repeats)
    return min(rounds)


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raise `TimeUp` after the given processor time of this process [s]."""

    def stop(*_: object) -> None:
        raise TimeUp(f"not done after {seconds:g} s")

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
