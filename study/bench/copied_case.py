"""A copy of a case beside it, whose effect files lie apart: what is done with it leaves those of the user alone."""

import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from study.bench.case_text import list_effect_files, with_effect_files
from study.diagnose.history import history_file, write_beside


def find_apart(copy: Path) -> Path:
    """Folder of the effect files of a copy."""
    return copy.with_suffix("")


@contextmanager
def copy_beside(case: Path, text: str, history: str, effects: Mapping[str, str] | None = None) -> Iterator[Path]:
    """A copy of a case beside it, where it finds the same files; it is removed in the end.

    Parameters
    ----------
    case
        The case.
    text, history
        What the copy and its history say; no history if that is empty.
    effects
        Texts of effect files by the names that the case has for them: the copy names files of its own instead.

    Raises
    ------
    OutputError
        The folder cannot be written.
    """
    with tempfile.NamedTemporaryFile(dir=case.parent, prefix=f".{case.stem}-", suffix=".toml", delete=False) as stream:
        copy = Path(stream.name)
    try:
        for name, source in (effects or {}).items():
            write_apart(copy, name, source)
        write_beside(copy, name_apart(copy, text))
        if history:
            write_beside(history_file(copy), history)
        yield copy
    finally:
        for file in (copy, history_file(copy)):
            file.unlink(missing_ok=True)
        shutil.rmtree(find_apart(copy), ignore_errors=True)


def write_apart(copy: Path, name: str, text: str) -> Path:
    """Write an effect file of a copy, where nobody else may change it before it runs."""
    find_apart(copy).mkdir(mode=0o700, exist_ok=True)
    file = find_apart(copy) / name
    file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    write_beside(file, text)
    return file


def name_apart(copy: Path, text: str) -> str:
    """Text of a case that names the effect files of its copy, where the copy has files of its own."""
    files = list_effect_files(text)
    own = [f"{find_apart(copy).name}/{name}" if (find_apart(copy) / name).is_file() else name for name in files]
    return text if own == files else with_effect_files(text, own)
