"""Store compiled code in files with a checksum; only the machine code is read until more is needed.

The checksum is needed because machine code with one changed bit crashes the program or gives wrong results.
"""

import hashlib
import io
import pickle
from functools import cache
from pathlib import Path
from typing import Any

#: Length of a checksum [byte].
CHECKSUM = 32


class DamagedCode(Exception):
    """Error for a file whose content does not match its checksum."""


@cache
def checked_file_class() -> type[Any]:
    """Numba's class of an index and its data files, changed so that files begin with the SHA-256 of their content."""
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


@cache
def stored_library_class() -> type[Any]:
    """Numba's class of the machine code of a function, changed so that the code's LLVM module is not read at once.

    The module is needed only to compile another function that calls it, and reading it takes most of the loading time.
    """
    from llvmlite.binding import parse_bitcode
    from numba.core.codegen import JITCodeLibrary

    class StoredLibrary(JITCodeLibrary):
        _machine_code, _unread = b"", None

        @classmethod
        def _unserialize(cls: Any, codegen: Any, state: Any) -> Any:
            name, kind, data = state
            if kind != "object":
                return super()._unserialize(codegen, state)  # type: ignore[no-untyped-call]
            library = cls(codegen, name)
            library._machine_code, library._unread = data
            library.enable_object_caching()
            library._set_compiled_object(library._machine_code)
            library._finalize_final_module()
            return library

        def _get_module_for_linking(self: Any) -> Any:
            if self._unread is not None:
                self._shared_module, self._unread = parse_bitcode(self._unread), None
                self._codegen._engine._load_defined_symbols(self._shared_module)
            return super()._get_module_for_linking()  # type: ignore[no-untyped-call]

        def get_pointer_to_function(self: Any, name: str) -> Any:
            if self._unread is not None and b"\0" + name.encode() + b"\0" in self._machine_code:
                return self._codegen._engine.get_function_address(name)
            # A name may also be stored as the end of a longer name: only the module shows whether it exists.
            self._get_module_for_linking()
            return super().get_pointer_to_function(name)  # type: ignore[no-untyped-call]

    return StoredLibrary


def _read(path: Path) -> bytes:
    whole = path.read_bytes()
    checksum, content = whole[:CHECKSUM], whole[CHECKSUM:]
    if hashlib.sha256(content).digest() != checksum:
        raise DamagedCode(path)
    return content
