"""A stored record: one value in one file, with its name, key and computing time.

The file is a ZIP container, which NumPy reads as it reads ``.npz``::

    0.npy, 1.npy, ...   the large arrays of the value
    pooled_<f8.npy, ... its small ones, by type, one behind the other
    tree.json           the value, with names for the arrays (`pipeline.codec`)
    places.json         where each small array is (`pipeline.pooled_arrays`)
    header.json         name, key, seconds

Its comment, the last 64 bytes of the file, is the SHA-256 of all bytes before. The file is written under another name
and then renamed: at any moment, after any crash and with any number of processes, a record is complete or absent. The
checksum reveals later damage.
"""

import hashlib
import json
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

from pipeline.codec import decode, encode
from pipeline.output import open_draft
from pipeline.pooled_arrays import ArrayPlaces, pool_arrays, unpool_array

#: Members of the container that are not arrays.
TREE, PLACES, HEADER = "tree.json", "places.json", "header.json"
#: Length of the checksum [byte].
CHECKSUM = 64


class DamagedRecord(Exception):
    """An existing record that cannot be read."""


@dataclass(frozen=True, kw_only=True)
class Record:
    """A value to be stored.

    Parameters
    ----------
    value
        Value of a kind that `pipeline.codec` knows.
    name
        Name for messages.
    key
        Hexadecimal hash of its inputs and code.
    seconds
        Wall-clock time of its computation [s].
    """

    value: Any
    name: str = ""
    key: str = ""
    seconds: float = 0.0


def write_record(file: Path, record: Record, drafts: Path | None = None) -> None:
    """Write a record; an existing one is replaced.

    Parameters
    ----------
    file
        Path in an existing folder.
    record
        Record to write.
    drafts
        Folder of unfinished files on the same disk; that of the file by default.

    Raises
    ------
    TypeError
        A value of an unsupported kind.
    OSError
        The disk refuses it; no partial file remains.
    """
    tree, arrays = encode(record.value)
    stored, places = pool_arrays(arrays)
    header = {"name": record.name, "key": record.key, "seconds": record.seconds}
    with open_draft(file, drafts) as stream:
        if stored:
            from reduction.file.npz import write_npz

            write_npz(stream, stored)
        with zipfile.ZipFile(stream, "a") as archive:
            for name, content in ((TREE, tree), (PLACES, places), (HEADER, header)):
                archive.writestr(zipfile.ZipInfo(name), json.dumps(content, separators=(",", ":")))
            archive.comment = bytes(CHECKSUM)
        length = stream.tell() - CHECKSUM
        checksum = _compute_checksum(stream, length)
        stream.seek(length)
        stream.write(checksum)


def read_record(file: Path) -> Record | None:
    """A record; None if it does not exist.

    Raises
    ------
    DamagedRecord
        It cannot be read, or is not what was written.
    """
    try:
        with file.open("rb") as stream:
            if not _is_intact(stream):
                raise ValueError("its checksum is another")
            with zipfile.ZipFile(stream) as archive:
                header = json.loads(archive.read(HEADER))
                array = _ArrayReader(archive, json.loads(archive.read(PLACES)))
                value = decode(json.loads(archive.read(TREE)), array)
                return Record(value=value, **header)
    except FileNotFoundError:
        return None
    except Exception as error:  # of many kinds, depending on the damaged byte or the code that wrote it
        raise DamagedRecord(f"{file}: {error}") from error


def is_intact(file: Path) -> bool:
    """Whether a record exists with all bytes as written."""
    try:
        with file.open("rb") as stream:
            return _is_intact(stream)
    except OSError:
        return False


def _is_intact(stream: BinaryIO) -> bool:
    length = stream.seek(0, 2) - CHECKSUM
    return length > 0 and _compute_checksum(stream, length) == stream.read()


def _compute_checksum(stream: BinaryIO, length: int) -> bytes:
    """SHA-256 of the first bytes of a file; the stream is positioned after them."""
    digest = hashlib.sha256()
    stream.seek(0)
    while length and (block := stream.read(min(length, 1 << 20))):
        digest.update(block)
        length -= len(block)
    return digest.hexdigest().encode()


class _ArrayReader:
    """Gives the arrays of a record by their names; pooled arrays are read once."""

    def __init__(self, archive: zipfile.ZipFile, places: ArrayPlaces) -> None:
        self._archive, self._places = archive, places
        self._pools: dict[str, Any] = {}

    def __call__(self, name: str) -> Any:
        if name not in self._places:
            return self._read(name)
        pool = self._places[name][0]
        if pool not in self._pools:
            self._pools[pool] = self._read(pool)
        return unpool_array(self._pools[pool], self._places[name])

    def _read(self, name: str) -> Any:
        from numpy.lib.format import read_array

        with self._archive.open(f"{name}.npy") as member:
            return read_array(member, allow_pickle=False)
