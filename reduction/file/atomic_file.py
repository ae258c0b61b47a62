"""Files that are written whole or not at all."""

import os
import uuid
from collections.abc import Callable
from pathlib import Path

from geometry.errors import InputError
from reduction.errors import ExchangeError


def write_atomically(
    path: Path | str, write: Callable[[Path], object], error_type: type[InputError] = ExchangeError
) -> None:
    """Write a file atomically: a file of that name is replaced as a whole, or stays as it was if anything fails.

    `write` writes a file of the name that it is given, in the same folder, which must exist.

    Raises
    ------
    InputError
        Of the kind `error_type`: the folder does not exist, or the file cannot be written.
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise error_type(f'"{path}" cannot be written: there is no folder "{path.parent}", create it first')
    temporary = path.with_name(f".{path.name}.{uuid.uuid4().hex}.part")
    try:
        write(temporary)
        temporary.replace(path)
    except OSError as error:
        # HDF5 puts a paragraph where the system has a few words.
        reason = os.strerror(error.errno) if error.errno else error
        raise error_type(
            f'"{path}" cannot be written ({reason}): choose another folder, or free space in it'
        ) from error
    finally:
        temporary.unlink(missing_ok=True)
