"""Read untrusted files, which may crash or hang their reader, in a trial process first.

The CAD kernel and HDF5 do not check counts and addresses in their files: a damaged file can crash the program or cause
an endless loop, which cannot be predicted from outside. The program therefore forks (about ten milliseconds), and the
child process reads the file first, with limits of processor time and memory, and discards the content. If the child
survives, the file is read again in the parent.

A child that waits without working, for example for a lock that another thread held, shows nothing about the file: it is
ended after a while, and the file is read.
"""

import contextlib
import os
import resource
import signal
import time
import warnings
from collections.abc import Callable
from pathlib import Path

#: Processor time [s], and memory in addition to that of the program [byte], that are allowed for any file.
LEAST_SECONDS, LEAST_MEMORY = 2, 1 << 30
#: Time after which a child whose threads all sleep is waiting [s]; on a busy machine threads wait to run, not asleep.
PATIENCE = 1.0
#: Exit code of a child that ran out of memory.
_NO_MEMORY = 3


def read_in_trial_process(read: Callable[[], object], file: Path, *, speed: float, memory: float) -> str | None:
    """Read a file in a child process with limits of time and memory.

    Parameters
    ----------
    read
        Function that reads the file; its result and its errors are ignored.
    file
        The file; its size determines the limits.
    speed
        Lowest reading speed per processor time [byte/s].
    memory
        Memory that reading may need per byte of the file, in addition to `LEAST_MEMORY` [-].

    Returns
    -------
    Reason why the file must not be read in this process, as the end of a sentence with the file as its subject; None if
    it may be read.
    """
    size = file.stat().st_size
    seconds, most = LEAST_SECONDS + int(size / speed), LEAST_MEMORY + int(memory * size)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of Python, about threads; see the module docstring
        child = os.fork()
    if not child:
        _read_and_end(read, seconds, most)
    try:
        status = _wait(child)
    except BaseException:  # such as Ctrl-C
        _end(child)
        raise
    if status is None:
        _end(child)
        return None
    if os.WIFSIGNALED(status):
        number = os.WTERMSIG(status)
        if number == signal.SIGXCPU:
            return f"keeps its reader busy for more than {seconds} s"
        ended_from_outside = number in {signal.SIGKILL, signal.SIGTERM, signal.SIGINT}
        return None if ended_from_outside else f"ends its reader ({signal.Signals(number).name})"
    if os.WEXITSTATUS(status) == _NO_MEMORY:
        return f"needs more than {most / 1e9:.3g} GB to be read"
    return None


def _read_and_end(read: Callable[[], object], seconds: int, memory: int) -> None:
    code = 0
    try:
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGFPE):
            signal.signal(number, signal.SIG_DFL)
        nowhere = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(nowhere, stream)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + LEAST_SECONDS))
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + memory, resource.RLIM_INFINITY))
        read()
    except MemoryError:
        code = _NO_MEMORY
    except BaseException:
        pass  # reading again raises the same error with a message
    finally:
        os._exit(code)


def _wait(child: int) -> int | None:
    """Exit status of a process; None if it waits without working."""
    worked, last, pause = 0, time.monotonic(), 0.0005
    while time.monotonic() < last + PATIENCE:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return status
        time.sleep(pause)
        pause = min(1.5 * pause, 0.05)
        now, sleeps = _work(child)
        if now > worked or not sleeps:
            worked, last = now, time.monotonic()
    return None


def _work(process: int) -> tuple[int, bool]:
    """Processor time that a process has used [tick], and whether all its threads sleep."""
    taken, states = 0, set()
    for thread in Path(f"/proc/{process}/task").iterdir():
        with contextlib.suppress(OSError):  # a thread that has ended
            fields = (thread / "stat").read_text(encoding="ascii", errors="replace").rpartition(")")[2].split()
            taken += int(fields[11]) + int(fields[12])
            states.add(fields[0])
    return taken, states <= {"S"}


def _end(child: int) -> None:
    with contextlib.suppress(ProcessLookupError, ChildProcessError):
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
