"""How many threads the linear algebra of a command has; imports nothing, so that it can be said before NumPy asks."""

import os

#: What the libraries under NumPy, SciPy and PARDISO read when they are loaded.
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")


def one_thread_by_default() -> None:
    """One thread, unless the user has asked for others.

    Reduced models have some hundred coordinates: a second thread gains nothing there, and beside other work on the
    machine threads that wait for each other took fifteen times as long.
    """
    for name, value in ONE_THREAD.items():
        os.environ.setdefault(name, value)
