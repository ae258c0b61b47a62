"""Read arrays of an ``.npz`` file; sizes are checked against the bytes of the file before memory is allocated."""

import sys
import zipfile
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

#: Largest ratio of uncompressed to compressed bytes: Deflate reaches about a thousand (RFC 1951: 258 bytes from two
#: bits); NumPy writes no other method.
HIGHEST_RATIO = 1100
_SUFFIX = ".npy"


class NpzError(ValueError):
    """Error of an archive, as the end of a sentence."""


class ObjectArray(NpzError):
    """Error for an array of Python objects, which is never read."""


def read_npz_headings(path: Path) -> dict[str, tuple[tuple[int, ...], np.dtype[Any]]]:
    """Shape and type of each array by its name; no array is read.

    Raises
    ------
    NpzError
        A file that is not an archive of arrays, or an array whose announced size does not fit the file.
    """
    with _open(path) as archive:
        return {name: _read_heading(archive, path, name) for name in _list_names(archive)}


def read_npz(path: Path, names: Collection[str] | None = None) -> Mapping[str, NDArray[Any]]:
    """Read arrays by name, all arrays by default.

    Raises
    ------
    NpzError
        As in `read_npz_headings`, or a damaged array.
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
                except Exception as error:  # many kinds, depending on the damaged byte
                    raise NpzError(f'its array "{name}" is damaged ({type(error).__name__})') from None
        return result


def _check_text(array: NDArray[Any]) -> NDArray[Any]:
    """Array whose texts contain valid code points only; NumPy does not check them."""
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
    """Shape and type in the heading of an array, checked against the bytes of the array."""
    info = archive.getinfo(name + _SUFFIX)
    try:
        with archive.open(info) as member:
            version = npy.read_magic(member)
            heading: Any = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
            shape, _, kind = heading(member)
            behind = info.file_size - member.tell()
    except Exception as error:  # many kinds, depending on the damaged byte
        raise NpzError(f'its array "{name}" is damaged ({type(error).__name__})') from None
    size = int(np.prod(shape, dtype=object)) * kind.itemsize
    fits = info.compress_size <= path.stat().st_size and info.file_size <= HIGHEST_RATIO * (info.compress_size + 1)
    if not kind.hasobject and (size != behind or not fits):
        raise NpzError(f'its array "{name}" announces {size} bytes, which are not in the file')
    return shape, kind
