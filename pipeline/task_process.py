"""A process next to a dask worker that runs its tasks in sequence.

A task does not run in the worker itself: here it has the main thread and one BLAS thread, as in the processes of this
machine; it can be killed when its result is no longer needed; and the worker answers its scheduler meanwhile. Each
thread of a worker has one such process. It ends with the worker, or after some idle time.
"""

import importlib
import os
import pickle
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from io import BytesIO
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any

from geometry.errors import ComputationFailed, InputError
from geometry.registry import load_file
from pipeline.blas_threads import ONE_THREAD
from pipeline.fingerprint import hash_code
from pipeline.parallel import end_with, make_portable_error
from pipeline.source_facts import find_source_facts

#: Interval at which a worker asks whether its task is still wanted [s].
LOOK_EVERY = 0.2
#: Idle time after which a process ends [s].
IDLE = 60.0
#: Number of kills of its process after which a task is given up: it most probably needs more memory than available.
MOST_DEATHS = 3


@dataclass(frozen=True, kw_only=True)
class SharedValue:
    """A value that many tasks need, and that is sent once.

    Parameters
    ----------
    key
        Unique name.
    pickled
        The value.
    """

    key: str
    pickled: bytes


@dataclass(frozen=True, kw_only=True)
class RemoteCall:
    """A call of a function on another machine.

    Parameters
    ----------
    pickled
        Function, arguments and named arguments; shared values are replaced by their keys.
    versions
        Code version of the modules that the result depends on.
    plugins
        Hashes of the user's files that this process has loaded.
    """

    pickled: bytes
    versions: Mapping[str, str]
    plugins: Mapping[str, str]


class _Unpickler(pickle.Unpickler):
    """Reads a call with shared values given by key."""

    def __init__(self, content: bytes, shared: Mapping[str, Any]) -> None:
        super().__init__(BytesIO(content))
        self._shared = shared

    def persistent_load(self, pid: Any) -> Any:
        """The shared value of a key."""
        return self._shared[pid]


class TaskProcess:
    """Handle of the process of one thread of a worker."""

    def __init__(self) -> None:
        self._connection, theirs = Pipe()
        # Nothing is ever sent: the process sees the end of file when this one closes its end, or is killed.
        alive, self._stays_open = Pipe(duplex=False)
        with theirs, alive:
            handles = theirs.fileno(), alive.fileno()
            self._process = subprocess.Popen(
                [sys.executable, "-c", f"from pipeline.task_process import serve; serve{handles}"],
                env={**os.environ, **ONE_THREAD, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
                pass_fds=handles,
                stdin=subprocess.DEVNULL,
                start_new_session=True,
            )
        self._known: set[str] = set()

    @property
    def ended(self) -> bool:
        """Whether it has ended."""
        return self._process.poll() is not None

    def run(self, call: RemoteCall, shared: Sequence[SharedValue], is_wanted: Callable[[], bool]) -> bytes | None:
        """Pickled result of a call; None if it is no longer wanted.

        Raises
        ------
        OSError, EOFError
            The process was killed.
        """
        values = {item.key: None if item.key in self._known else item.pickled for item in shared}
        self._connection.send((call, values))
        self._known = set(values)
        while not self._connection.poll(LOOK_EVERY):
            if not is_wanted():
                return None
        return self._connection.recv_bytes()

    def kill(self) -> None:
        """End it, with the programs that it runs."""
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        self._connection.close()
        self._stays_open.close()


_own = threading.local()


def run_in_task_process(call: RemoteCall, *shared: SharedValue) -> bytes:
    """Run a call in the process of this thread of a dask worker.

    Returns
    -------
    Its pickled result and whether that is an error, see `unpack`; empty if it was cancelled.
    """
    for _ in range(MOST_DEATHS):
        process: TaskProcess | None = getattr(_own, "process", None)
        if process is None or process.ended:
            process = _own.process = TaskProcess()
        try:
            result = process.run(call, shared, _is_wanted)
        except (OSError, EOFError):
            result = None
        if result is not None:
            return result
        process.kill()
        _own.process = None
        if not _is_wanted():
            return b""
    return _pack(
        True,
        ComputationFailed(
            f"the process of a task was killed {MOST_DEATHS} times on {socket.gethostname()}, most often for lack of "
            "memory: start fewer workers there; what was finished is stored, and the same command continues from there"
        ),
    )


def _is_wanted() -> bool:
    """Whether the task of this thread is still assigned to this worker."""
    from distributed import get_worker
    from distributed.core import Status
    from distributed.worker import thread_state

    worker = get_worker()
    task = worker.state.tasks.get(thread_state.key)
    return task is not None and task.state != "cancelled" and worker.status in (Status.running, Status.paused)


def serve(connection_handle: int, alive_handle: int) -> None:
    """Run tasks as they arrive, until the worker ends or sends none for a while."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=end_with, args=(Connection(alive_handle),), daemon=True).start()
    connection = Connection(connection_handle)
    shared: dict[str, Any] = {}
    while connection.poll(IDLE):
        try:
            call, values = connection.recv()
        except EOFError:
            return
        try:
            _require_same_code(call)
            shared = {key: shared[key] if content is None else pickle.loads(content) for key, content in values.items()}
            function, arguments, named = _Unpickler(call.pickled, shared).load()
            answer = _pack(False, function(*arguments, **named))
        except Exception as error:
            answer = _pack(True, make_portable_error(error))
        connection.send_bytes(answer)


def unpack(answer: bytes) -> Any:
    """The result of a call, or its error raised."""
    failed, value = pickle.loads(answer)
    if failed:
        raise value
    return value


def _pack(failed: bool, value: object) -> bytes:
    return pickle.dumps((failed, value))


def _require_same_code(call: RemoteCall) -> None:
    other = [module for module, version in call.versions.items() if _try_hash_code(module) != version]
    if other:
        raise InputError(
            f"the worker on {socket.gethostname()} has a different version of stickslip ({other[0]}), Python, NumPy "
            "or SciPy: install the same versions there, and restart its workers"
        )
    for file, version in call.plugins.items():
        if find_source_facts(load_file(file)).code != version:
            raise InputError(f"{file} is another file on {socket.gethostname()}: copy it there as well")


def _try_hash_code(module: str) -> str:
    try:
        importlib.import_module(module)  # tells where it is, also in a folder that is no package
        return hash_code(module)
    except (ImportError, OSError, TypeError, ValueError):
        return ""
