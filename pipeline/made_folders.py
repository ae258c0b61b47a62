"""Folders that a command made for its files: one that is refused before it has written any leaves none behind."""

import contextlib
from collections.abc import Iterator
from contextvars import ContextVar
from pathlib import Path

_MADE: ContextVar[list[Path] | None] = ContextVar("made folders", default=None)


def make_folder(folder: Path) -> None:
    """Make a folder with those above it, and remember the new ones while `removed_if_empty` is entered.

    Raises
    ------
    OSError
        It cannot be made.
    """
    missing = [each for each in (folder, *folder.parents) if not each.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    made = _MADE.get()
    if made is not None:
        made += missing


@contextlib.contextmanager
def removed_if_empty() -> Iterator[None]:
    """When what runs within fails, remove the folders that it made and that hold nothing."""
    made: list[Path] = []
    token = _MADE.set(made)
    try:
        yield
    except BaseException:
        for folder in made:  # the deepest first, as they were found
            with contextlib.suppress(OSError):  # it holds something
                folder.rmdir()
        raise
    finally:
        _MADE.reset(token)
