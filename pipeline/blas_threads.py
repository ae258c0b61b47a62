"""Number of threads of a command's linear algebra; imports nothing, so that it is set before NumPy is imported."""

import os

#: Variables that NumPy's and SciPy's library reads when it is loaded; their matrices are small everywhere.
ONE_OPENBLAS_THREAD = {"OPENBLAS_NUM_THREADS": "1"}
#: Variables that the libraries under NumPy, SciPy and PARDISO read when they are loaded.
ONE_THREAD = {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", **ONE_OPENBLAS_THREAD}


def set_one_thread_by_default() -> None:
    """One thread, unless the user has asked for others.

    Reduced models have some hundred coordinates: a second thread gains nothing there, and on a busy machine waiting
    threads took fifteen times as long.
    """
    _set_by_default(ONE_THREAD)


def set_one_openblas_thread_by_default() -> None:
    """One thread for NumPy and SciPy, unless the user has asked for others; MKL factorises on all cores.

    For commands that work on large sparse matrices. In Python `fe.blas_threads` does the same.
    """
    _set_by_default(ONE_OPENBLAS_THREAD)


def _set_by_default(threads: dict[str, str]) -> None:
    for name, value in threads.items():
        os.environ.setdefault(name, value)
