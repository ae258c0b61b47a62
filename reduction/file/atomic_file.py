"""Write files completely or not at all."""

import os
import uuid
from collections.abc import Callable
from pathlib import Path

from geometry.errors import InputError
from reduction.errors import ExchangeError


def write_atomically(
    path: Path | str, write: Callable[[Path], object], error_type: type[InputError] = ExchangeError
) -> None:
    """Write a file atomically: an existing file is replaced completely, or kept if anything fails.

    `write` is called with the path of a temporary file in the same folder, which must exist, and writes this file.

    Raises
    ------
    InputError
        The folder does not exist, or the file cannot be written; the error is of the type `error_type`.
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise error_type(f'"{path}" cannot be written: there is no folder "{path.parent}", create it first')
    temporary = path.with_name(f".{path.name}.{uuid.uuid4().hex}.part")
    try:
        write(temporary)
        temporary.replace(path)
    except OSError as error:
        # The system's message is short; that of HDF5 is a paragraph.
        reason = os.strerror(error.errno) if error.errno else error
        raise error_type(
            f'"{path}" cannot be written ({reason}): choose another folder, or free space in it'
        ) from error
    finally:
        temporary.unlink(missing_ok=True)
