"""Output folders and files: refused at once if they cannot be written, and never left half-written."""

import errno
import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from typing import BinaryIO

from geometry.errors import OutputError

#: Folders that a command made for its files.
_MADE: ContextVar[list[Path] | None] = ContextVar("made folders", default=None)
#: Errors of too many open files.
HANDLES = {errno.EMFILE, errno.ENFILE}
#: Errors of a disk, such as a full one.
DISK = {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO, errno.EFBIG}


def prepare_output(path: str | Path) -> Path:
    """Create an output folder and prove that files can be written into it.

    Parameters
    ----------
    path
        The folder; it may exist and contain files.

    Returns
    -------
    The folder.

    Raises
    ------
    OutputError
        It is a file, or cannot be created or written.
    """
    folder = Path(path)
    try:
        missing = [parent for parent in (folder, *folder.parents) if not parent.exists()]
        folder.mkdir(parents=True, exist_ok=True)
        made = _MADE.get()
        if made is not None:
            made += missing
        with tempfile.TemporaryFile(dir=folder):
            pass
    except FileExistsError:
        raise OutputError(f"the output folder {folder} is a file: name another folder with --out") from None
    except OSError as error:
        reason = error.strerror or type(error).__name__
        message = f"the output folder {folder} cannot be written ({reason}): name another one with --out"
        raise OutputError(message) from None
    return folder


@contextmanager
def removed_if_empty() -> Iterator[None]:
    """Remove the empty folders that `prepare_output` made within this context, if it fails."""
    made: list[Path] = []
    token = _MADE.set(made)
    try:
        yield
    except BaseException:
        for folder in made:  # the deepest first, as they were found
            with suppress(OSError):  # it holds something
                folder.rmdir()
        raise
    finally:
        _MADE.reset(token)


@contextmanager
def open_draft(path: Path, drafts: Path | None = None) -> Iterator[BinaryIO]:
    """A file open for writing and reading that replaces `path` at the end, or is removed if writing fails.

    Parameters
    ----------
    path
        The file, in an existing folder: a reader, or a crash, finds its old content or the new, never a part.
    drafts
        Folder of the draft, on the same disk; that of `path` by default.
    """
    handle, name = tempfile.mkstemp(prefix=f".{path.name}-", dir=drafts or path.parent)
    draft = Path(name)
    try:
        with os.fdopen(handle, "w+b") as stream:
            yield stream
        # mkstemp makes private files; results get the permissions of the user's other files.
        umask = os.umask(0)
        os.umask(umask)
        draft.chmod(0o666 & ~umask)
        draft.replace(path)
    except BaseException as error:
        draft.unlink(missing_ok=True)
        if isinstance(error, OSError):
            error.filename = str(path)
        raise


def replace_file(path: Path, content: str | bytes) -> None:
    """Write a file such that a reader, or a crash, finds the old content or the new, never a part.

    Parameters
    ----------
    path
        The file, in an existing folder.
    content
        Text is written as UTF-8.
    """
    with open_draft(path) as stream:
        stream.write(content.encode("utf-8") if isinstance(content, str) else content)


def describe_system_failure(error: BaseException) -> str | None:
    """Message for a failed disk write, or for too many open files, with the remedy; None for other errors.

    HDF5 gives the error number and the file only in its text.
    """
    number = getattr(error, "errno", None)
    text = str(error)
    written = re.search(r"errno = (\d+)", text)
    if number is None and written is not None:
        number = int(written[1])
    if number in HANDLES:
        return "too many open files for this session (ulimit -n): raise the limit, e.g. ulimit -n 1024"
    if number not in DISK:
        return None
    named = re.search(r"filename = '(.+?)'", text)
    file = getattr(error, "filename", None) or (named[1] if named else "a file")
    return f"{file} cannot be written ({os.strerror(number)}): free some space, or write elsewhere (--out, --cache)"
