"""Load the shared library of CHOLMOD from the system, and define its structures.

No Python wheel contains it (Debian: `libcholmod3` or `libcholmod5`). Only those fields of its structures are used whose
offsets are the same in versions 3 to 5.
"""

import ctypes
import ctypes.util
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from ctypes import POINTER, c_double, c_int, c_size_t, c_void_p
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fe.sparse import mkl

#: Number of bytes for the opaque `cholmod_common`: 2.6 kB in version 3, more in later versions.
COMMON = 1 << 16
A_X_IS_B, PATTERN, REAL, LOWER = 0, 0, 1, -1
#: Offset in `cholmod_common` of the parameters for merging supernodes [byte], and their defaults, which check the
#: offsets.
RELAXED, RELAXED_BY_DEFAULT = 80, (0.8, 0.1, 0.05)
#: Offsets of the flag for an L L^T factor without supernodes, and of the number of orderings to try [byte].
IS_LL, N_ORDERING = 60, 168
#: Shift of the diagonal of a matrix that is factorised.
NO_SHIFT = (c_double * 2)(0.0, 0.0)
#: OpenMP runtimes that CHOLMOD may use: its own, or the one that MKL has loaded before.
OPENMP = ("libgomp.so.1", "libiomp5.so")


class Sparse(ctypes.Structure):
    """Structure cholmod_sparse."""

    _fields_ = [
        *((name, c_size_t) for name in ("nrow", "ncol", "nzmax")),
        *((name, c_void_p) for name in ("p", "i", "nz", "x", "z")),
        *((name, c_int) for name in ("stype", "itype", "xtype", "dtype", "sorted", "packed")),
    ]


class Dense(ctypes.Structure):
    """Structure cholmod_dense."""

    _fields_ = [
        *((name, c_size_t) for name in ("nrow", "ncol", "nzmax", "leading")),
        *((name, c_void_p) for name in ("x", "z")),
        *((name, c_int) for name in ("xtype", "dtype")),
    ]


class FactorHead(ctypes.Structure):
    """Structure cholmod_factor."""

    _fields_ = [
        *((name, c_size_t) for name in ("n", "minor")),
        *((name, c_void_p) for name in ("order", "column_count", "inverse_order")),
        ("nzmax", c_size_t),
        *((name, c_void_p) for name in ("p", "i", "x", "z", "nz", "next", "previous")),
        *((name, c_size_t) for name in ("n_supernode", "n_row", "n_value", "largest_update", "largest_height")),
        *((name, c_void_p) for name in ("column", "row_start", "value_start", "row")),
        *((name, c_int) for name in ("ordering", "is_ll", "is_super", "is_monotonic", "itype", "xtype", "dtype")),
    ]


def view_integers(address: int, n: int) -> NDArray[np.int32]:
    """View of integers in CHOLMOD's memory, shape (n,)."""
    return np.ctypeslib.as_array(ctypes.cast(address, POINTER(c_int)), (n,))


def view_doubles(address: int, n: int) -> NDArray[np.float64]:
    """View of real numbers in CHOLMOD's memory, shape (n,)."""
    return np.ctypeslib.as_array(ctypes.cast(address, POINTER(c_double)), (n,))


def configure(common: Any, *, is_ordered: bool) -> None:
    """Request that negative pivots fail, and only the given order if there is one; no change at unknown offsets."""
    if tuple(np.frombuffer(common, np.float64, 3, offset=RELAXED)) != RELAXED_BY_DEFAULT:
        return
    np.frombuffer(common, np.int32, 1, offset=IS_LL)[0] = 1
    if is_ordered:
        np.frombuffer(common, np.int32, 1, offset=N_ORDERING)[0] = 1


@contextmanager
def one_thread() -> Iterator[None]:
    """Keep CHOLMOD from starting four threads for each of its loops, which takes longer than the loops."""
    loaded = [runtime for name in OPENMP if (runtime := _find_loaded(name)) is not None]
    before = [runtime.omp_get_max_active_levels() for runtime in loaded]
    for runtime in loaded:
        runtime.omp_set_max_active_levels(0)
    try:
        yield
    finally:
        for runtime, levels in zip(loaded, before, strict=True):
            runtime.omp_set_max_active_levels(levels)


def _find_loaded(name: str) -> Any:
    """Library that this process has loaded already, or None."""
    try:
        return ctypes.CDLL(name, mode=os.RTLD_NOLOAD)
    except (AttributeError, OSError):  # Windows has no such mode
        return None


@cache
def _name() -> str | None:
    """Name of the library; the search starts other processes and is therefore done once."""
    return ctypes.util.find_library("cholmod")


@cache
def library() -> Any:
    """Load the shared library.

    Raises
    ------
    OSError
        The library was not found or cannot be loaded.
    """
    name = _name()
    if name is None:
        raise OSError("libcholmod was not found: apt-get install libcholmod3 (Debian 12) or libcholmod5 (Debian 13)")
    # CHOLMOD uses matrix products of globally loaded libraries: MKL's are faster than those of Debian's libraries.
    with suppress(ImportError, OSError):
        ctypes.CDLL(mkl.library()._name, mode=ctypes.RTLD_GLOBAL)
    shared = ctypes.CDLL(name)
    shared.cholmod_analyze_p.restype = c_void_p
    shared.cholmod_realloc.restype = c_void_p
    shared.cholmod_solve.restype = POINTER(Dense)
    shared.cholmod_analyze_p.argtypes = [c_void_p, c_void_p, c_void_p, c_size_t, c_void_p]
    shared.cholmod_factorize.argtypes = [c_void_p, c_void_p, c_void_p]
    shared.cholmod_super_numeric.argtypes = [c_void_p, c_void_p, c_void_p, c_void_p, c_void_p]
    shared.cholmod_change_factor.argtypes = [c_int, c_int, c_int, c_int, c_int, c_void_p, c_void_p]
    shared.cholmod_realloc.argtypes = [c_size_t, c_size_t, c_void_p, c_void_p, c_void_p]
    shared.cholmod_solve.argtypes = [c_int, c_void_p, c_void_p, c_void_p]
    for name in ("cholmod_free_factor", "cholmod_free_dense"):
        getattr(shared, name).argtypes = [c_void_p, c_void_p]
    for name in ("cholmod_start", "cholmod_finish"):
        getattr(shared, name).argtypes = [c_void_p]
    # Suppress the message for a matrix that is not positive definite; the exception reports it.
    try:
        shared.SuiteSparse_config_printf_func_set(None)
    except AttributeError:  # before SuiteSparse 7: the fifth function of a structure prints
        (c_void_p * 5).in_dll(shared, "SuiteSparse_config")[4] = None
    return shared
