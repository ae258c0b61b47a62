"""Memory that was freed, given back to the system: glibc keeps pieces below 32 MB for itself, a gigabyte of them."""

import ctypes
import sys


def give_back() -> None:
    """Let the system have what was freed; other platforms do it by themselves, or have no call for it."""
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # musl has none
        if trim is not None:
            trim(0)
