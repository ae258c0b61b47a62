"""Freed memory that goes back to the operating system: glibc keeps pieces below 32 MB, up to a gigabyte of them."""

import ctypes
import sys


def return_freed_memory() -> None:
    """Return freed memory to the operating system; only glibc needs the call (`malloc_trim`)."""
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # musl has none
        if trim is not None:
            trim(0)
