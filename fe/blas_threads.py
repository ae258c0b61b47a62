"""Restrict OpenBLAS to one thread for small matrices.

NumPy's and SciPy's OpenBLAS start a thread per core for a few hundred coordinates, and these threads wait for each
other in a busy loop: this gains nothing on an idle machine, and on a busy one a reduction took ten times as long. MKL,
which factorises large sparse matrices, keeps its threads.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, wraps
from threading import Lock
from typing import ParamSpec, TypeVar

from threadpoolctl import LibController, ThreadpoolController

P = ParamSpec("P")
R = TypeVar("R")

_lock = Lock()
#: Number of running calls, and number of threads of each library before the first of them.
_running = 0
_before: list[int] = []


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let OpenBLAS use one thread in this context; the last context that ends restores the former numbers."""
    global _running, _before
    with _lock:
        if not _running:
            _before = [int(library.num_threads) for library in _find_libraries()]
            _set([1] * len(_before))
        _running += 1
    try:
        yield
    finally:
        with _lock:
            _running -= 1
            if not _running:
                _set(_before)


def on_one_blas_thread(function: Callable[P, R]) -> Callable[P, R]:
    """Decorate a function to run with one BLAS thread."""

    @wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        with one_blas_thread():
            return function(*args, **kwargs)

    return limited


def _set(threads: list[int]) -> None:
    for library, number in zip(_find_libraries(), threads, strict=True):
        library.set_num_threads(number)


@cache
def _find_libraries() -> list[LibController]:
    """All OpenBLAS libraries of this process; those of NumPy and SciPy, which differ, are loaded first."""
    import numpy as np  # noqa: F401
    import scipy.linalg  # noqa: F401

    return list(ThreadpoolController().select(internal_api="openblas").lib_controllers)
