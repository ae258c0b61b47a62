"""Return of freed memory of a process to the system.

The C library keeps freed memory if small live objects lie between large freed ones: a diagnosis of a rig with 264
coordinates thus grew to 20 GB, of which 2 GB were in use.
"""

import ctypes
from functools import cache


def return_freed_memory() -> None:
    """Return freed memory to the system, if the C library supports it (glibc)."""
    trim = getattr(_load_process(), "malloc_trim", None)
    if trim is not None:
        trim(0)


@cache
def _load_process() -> ctypes.CDLL:
    """The libraries of this process, the C library among them."""
    return ctypes.CDLL(None)
