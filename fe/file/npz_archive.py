"""Arrays in an ``.npz`` file, whose sizes are compared with its bytes before memory is taken for them."""

import sys
import zipfile
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

#: Deflate makes a thousand bytes of one at most (RFC 1951: 258 bytes of two bits); other methods are not written.
HIGHEST_RATIO = 1100
_SUFFIX = ".npy"


class NpzError(ValueError):
    """Error of an archive, as the end of a sentence."""


class ObjectArray(NpzError):
    """An array of Python objects, which are never read."""


def read_npz_headings(path: Path) -> dict[str, tuple[tuple[int, ...], np.dtype[Any]]]:
    """Shape and type of each array by its name; no array is read.

    Raises
    ------
    NpzError
        No archive of arrays, or one with an array that cannot be in it.
    """
    with _open(path) as archive:
        return {name: _read_heading(archive, path, name) for name in _list_names(archive)}


def read_npz(path: Path, names: Collection[str] | None = None) -> Mapping[str, NDArray[Any]]:
    """Arrays by name; all of them by default.

    Raises
    ------
    NpzError
        As `read_npz_headings`, or an array that is damaged.
    ObjectArray
        An array of Python objects.
    """
    with _open(path) as archive:
        result = {}
        for name in _list_names(archive):
            if names is None or name in names:
                _, kind = _read_heading(archive, path, name)
                if kind.hasobject:
                    raise ObjectArray(f'its array "{name}" holds Python objects')
                try:
                    with archive.open(name + _SUFFIX) as member:
                        result[name] = _check_text(npy.read_array(member, allow_pickle=False))
                except Exception as error:  # a dozen kinds, depending on which byte is damaged
                    raise NpzError(f'its array "{name}" is damaged ({type(error).__name__})') from None
        return result


def _check_text(array: NDArray[Any]) -> NDArray[Any]:
    """An array whose texts are of letters that there are: Python does not check numbers in memory."""
    if array.dtype.kind == "U" and array.dtype.itemsize:
        codes = np.ascontiguousarray(array).view(np.uint8).view(array.dtype.newbyteorder("=").str[0] + "u4")
        if array.size and codes.astype(np.uint32).max() > sys.maxunicode:
            raise ValueError("no letter has this number")
    return array


def _open(path: Path) -> zipfile.ZipFile:
    try:
        return zipfile.ZipFile(path)
    except (zipfile.BadZipFile, ValueError, LookupError, NotImplementedError, OSError) as error:
        raise NpzError(f"it is not an archive of arrays ({error})") from None


def _list_names(archive: zipfile.ZipFile) -> list[str]:
    return [name.removesuffix(_SUFFIX) for name in archive.namelist() if name.endswith(_SUFFIX)]


def _read_heading(archive: zipfile.ZipFile, path: Path, name: str) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Shape and type that the heading of an array announces, and that its bytes can hold."""
    info = archive.getinfo(name + _SUFFIX)
    try:
        with archive.open(info) as member:
            version = npy.read_magic(member)
            heading: Any = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
            shape, _, kind = heading(member)
            behind = info.file_size - member.tell()
    except Exception as error:  # a dozen kinds, depending on which byte is damaged
        raise NpzError(f'its array "{name}" is damaged ({type(error).__name__})') from None
    size = int(np.prod(shape, dtype=object)) * kind.itemsize
    fits = info.compress_size <= path.stat().st_size and info.file_size <= HIGHEST_RATIO * (info.compress_size + 1)
    if not kind.hasobject and (size != behind or not fits):
        raise NpzError(f'its array "{name}" announces {size} bytes, which are not in the file')
    return shape, kind
