"""Return freed memory to the operating system: glibc keeps freed pieces below 32 MB, up to a gigabyte in total."""

import ctypes
import sys


def return_freed_memory() -> None:
    """Return freed memory to the operating system; only glibc needs the call (`malloc_trim`)."""
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # musl has none
        if trim is not None:
            trim(0)
