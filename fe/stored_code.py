"""Files of compiled code with a checksum: machine code with one changed bit ends the program, or computes nonsense."""

import hashlib
import io
import pickle
from functools import cache
from pathlib import Path
from typing import Any

#: Length of a checksum [byte].
CHECKSUM = 32


class DamagedCode(Exception):
    """A file that is not what was written."""


@cache
def checked_file_class() -> type[Any]:
    """Numba's class of an index and its data files, which begin with the SHA-256 of what follows."""
    from numba.core.caching import IndexDataCacheFile

    class CheckedFile(IndexDataCacheFile):
        def _load_index(self: Any) -> Any:
            try:
                content = io.BytesIO(_read(Path(self._index_path)))
            except FileNotFoundError:
                return {}
            if pickle.load(content) != self._version:
                return {}
            stamp, overloads = pickle.loads(content.read())
            return overloads if stamp == self._source_stamp else {}

        def _save_index(self: Any, overloads: Any) -> None:
            content = pickle.dumps(self._version, protocol=-1) + self._dump((self._source_stamp, overloads))
            self._write(self._index_path, content)

        def _load_data(self: Any, name: str) -> Any:
            return pickle.loads(_read(Path(self._data_path(name))))

        def _save_data(self: Any, name: str, data: Any) -> None:
            self._write(self._data_path(name), self._dump(data))

        def _write(self: Any, path: str, content: bytes) -> None:
            with self._open_for_write(path) as stream:
                stream.write(hashlib.sha256(content).digest() + content)

    return CheckedFile


def _read(path: Path) -> bytes:
    whole = path.read_bytes()
    checksum, content = whole[:CHECKSUM], whole[CHECKSUM:]
    if hashlib.sha256(content).digest() != checksum:
        raise DamagedCode(path)
    return content
