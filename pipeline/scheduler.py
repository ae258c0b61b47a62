"""Tasks on the workers of a dask scheduler, on this machine or others, with the interface of local processes.

The results equal those of this machine: a worker with other code is refused. Values that many tasks need are sent once.
The tasks of a lost worker are repeated by another one.
"""

import pickle
import socket
import uuid
import warnings
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError, Executor, Future
from contextlib import contextmanager
from dataclasses import is_dataclass
from functools import partial
from io import BytesIO
from typing import TYPE_CHECKING, Any, TypeVar

from geometry.errors import ComputationFailed, InputError, InputWarning, MissingSoftware
from geometry.registry import loaded_files
from pipeline.fingerprint import hash_code
from pipeline.source_facts import find_source_facts
from pipeline.task_process import RemoteCall, SharedValue, run_in_task_process, unpack

if TYPE_CHECKING:
    import distributed

T = TypeVar("T")

#: A scheduler that does not answer within this time counts as absent [s].
PATIENCE = 10.0
#: Smaller values are sent with each call: registering them with the scheduler costs about as much [bytes].
WORTH_SHARING = 10_000


@contextmanager
def scheduler_pool(address: str, modules: Sequence[str]) -> Iterator["SchedulerExecutor"]:
    """Workers of a dask scheduler; at an early end, including Ctrl-C, they stop their tasks for this command.

    Parameters
    ----------
    address
        Address of the scheduler, such as "tcp://node1:8786".
    modules
        Modules that the results depend on: their code must be the same there.

    Raises
    ------
    MissingSoftware
        dask.distributed is not installed.
    InputError
        No scheduler at the address, or one of another version.
    """
    client = _connect(address)
    executor = SchedulerExecutor(client, {module: hash_code(module) for module in modules})
    try:
        yield executor
    finally:
        executor.shutdown(cancel_futures=True)
        client.close()


def _connect(address: str) -> "distributed.Client":
    try:
        import dask
        import distributed
        from distributed.comm import get_address_host_port
    except ImportError as error:
        raise MissingSoftware(
            f"--scheduler {address} needs dask.distributed, which is not installed: sh install.sh, or in a "
            'checkout pip install -e ".[dask]"'
        ) from error
    # A call contains its data; beyond 10 MB dask would advise other ways of writing it.
    dask.config.set({"distributed.admin.large-graph-warning-threshold": "1 GB"})
    start = f"give the address that `dask scheduler` prints when it starts, such as tcp://{socket.gethostname()}:8786"
    try:
        # Before there is a client: one that fails leaves a thread, which dask ends when it is collected, and may wait.
        get_address_host_port(address)
    except ValueError as error:
        raise InputError(f"--scheduler {address} is not an address: {start}") from error
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of versions, which are compared below
            client = distributed.Client(address, timeout=PATIENCE, set_as_default=False)
    except OSError as error:
        raise InputError(f"--scheduler {address}: no dask scheduler answers there: {start}") from error
    theirs = client.get_versions()["scheduler"]["packages"]["distributed"]
    if theirs != distributed.__version__:
        client.close()
        raise InputError(
            f"--scheduler {address} runs dask {theirs}, but {distributed.__version__} is installed here: install "
            "the same version"
        )
    if not client.nthreads():
        warnings.warn(
            f"the scheduler {address} has no workers yet; tasks start with the first one: `dask worker {address}` "
            "starts one",
            InputWarning,
            stacklevel=2,
        )
    return client


class SchedulerExecutor(Executor):
    """Calls on the workers of a scheduler.

    Parameters
    ----------
    client
        Connection to it.
    versions
        Code version of the modules that results depend on.
    """

    def __init__(self, client: "distributed.Client", versions: Mapping[str, str]) -> None:
        self._client, self._versions = client, versions
        self._pending: set[distributed.Future] = set()
        self._shared: dict[int, tuple[weakref.ref[Any], str, distributed.Future]] = {}

    @property
    def n_worker(self) -> int:
        """Number of calls that can run at present, at least 1 [-]."""
        threads: dict[str, int] = self._client.nthreads()
        return max(sum(threads.values()), 1)

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> "Future[T]":
        """Run a call as soon as a worker is free; data classes among its arguments are sent once for all calls."""
        shared = {}
        for value in filter(_can_be_shared, (*args, *kwargs.values())):
            if (known := self._share(value)) is not None:
                shared[id(value)] = known
        call = RemoteCall(
            pickled=_pickle((fn, args, kwargs), {number: key for number, (key, _) in shared.items()}),
            versions=self._versions,
            plugins={str(file): find_source_facts(file).code for file in loaded_files()},
        )
        remote = self._client.submit(
            run_in_task_process,
            call,
            *(value for _, value in shared.values()),
            key=f"stickslip-{uuid.uuid4().hex}",
            pure=False,
        )
        future: Future[T] = Future()
        future.set_running_or_notify_cancel()
        self._pending.add(remote)
        remote.add_done_callback(partial(self._pass_on, future))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Cancel unfinished calls, if requested."""
        del wait
        pending, self._pending = self._pending, set()
        if cancel_futures and pending:
            self._client.cancel(list(pending), force=True)
        self._shared.clear()

    def _share(self, value: Any) -> "tuple[str, distributed.Future] | None":
        """Key and place of a value on the cluster, to which it is sent again if lost; None if it is small."""
        number = id(value)
        if number not in self._shared:
            pickled = pickle.dumps(value)
            if len(pickled) < WORTH_SHARING:
                return None
            item = SharedValue(key=uuid.uuid4().hex, pickled=pickled)
            future = self._client.submit(_identity, item, key=f"stickslip-shared-{item.key}", pure=False)
            gone = weakref.ref(value, lambda _: self._shared.pop(number, None))
            self._shared[number] = gone, item.key, future
        _, key, future = self._shared[number]
        return key, future

    def _pass_on(self, future: "Future[T]", remote: "distributed.Future") -> None:
        """Pass the result or error of a call to its future."""
        from distributed import KilledWorker

        if remote not in self._pending:
            future.set_exception(CancelledError())
            return
        try:
            result = unpack(remote.result())
        except KilledWorker as error:
            where = error.last_worker.address
            future.set_exception(
                ComputationFailed(
                    f"{error.allowed_failures + 1} workers ended during the same task, the last one {where}, most "
                    "often for lack of memory; what was finished is stored: the same command continues from there"
                )
            )
        except CancelledError:
            future.set_exception(
                ComputationFailed(
                    "the connection to the dask scheduler is lost: start it again; what was finished is stored, and "
                    "the same command continues from there"
                )
            )
        except ModuleNotFoundError as error:
            future.set_exception(InputError(f"a worker lacks a module ({error}): install stickslip there as well"))
        except BaseException as error:
            future.set_exception(error)
        else:
            future.set_result(result)
        self._pending.discard(remote)


def _identity(value: SharedValue) -> SharedValue:
    return value


def _can_be_shared(value: object) -> bool:
    """Whether an object may be kept between calls, so that it is sent to each worker once."""
    return is_dataclass(value) and not isinstance(value, type) and type(value).__weakrefoffset__ > 0


class _Pickler(pickle.Pickler):
    """Writes a call with its shared values replaced by keys."""

    def __init__(self, stream: BytesIO, keys: Mapping[int, str]) -> None:
        super().__init__(stream, protocol=pickle.HIGHEST_PROTOCOL)
        self._keys = keys

    def persistent_id(self, obj: Any) -> str | None:
        """Key of a shared value; None for all others."""
        return self._keys.get(id(obj))


def _pickle(value: object, keys: Mapping[int, str]) -> bytes:
    stream = BytesIO()
    _Pickler(stream, keys).dump(value)
    return stream.getvalue()
