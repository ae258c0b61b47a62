"""A copy of a case in its folder, with copies of its effect files, so that the files of the user stay unchanged."""

import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from study.bench.case_text import list_effect_files, with_effect_files
from study.diagnose.history import name_history_file, write_beside


def make_effect_folder(copy: Path) -> Path:
    """Folder of the effect files of a copy."""
    return copy.with_suffix("")


@contextmanager
def copy_beside(case: Path, text: str, history: str, effects: Mapping[str, str] | None = None) -> Iterator[Path]:
    """Make a copy of a case in the same folder, so that relative file names are valid; the copy is removed at the end.

    Parameters
    ----------
    case
        Path of the case.
    text, history
        Texts of the copy and of its history; an empty history is not written.
    effects
        Texts of effect files, by their names in the case: the copy names copies of these files instead.

    Raises
    ------
    OutputError
        The folder cannot be written.
    """
    with tempfile.NamedTemporaryFile(dir=case.parent, prefix=f".{case.stem}-", suffix=".toml", delete=False) as stream:
        copy = Path(stream.name)
    try:
        for name, source in (effects or {}).items():
            write_effect_copy(copy, name, source)
        write_beside(copy, use_effect_copies(copy, text))
        if history:
            write_beside(name_history_file(copy), history)
        yield copy
    finally:
        for file in (copy, name_history_file(copy)):
            file.unlink(missing_ok=True)
        shutil.rmtree(make_effect_folder(copy), ignore_errors=True)


def write_effect_copy(copy: Path, name: str, text: str) -> Path:
    """Write the copy of an effect file into a private folder, so that no other user can change it before it runs."""
    make_effect_folder(copy).mkdir(mode=0o700, exist_ok=True)
    file = make_effect_folder(copy) / name
    file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    write_beside(file, text)
    return file


def use_effect_copies(copy: Path, text: str) -> str:
    """Replace the names of effect files in the text of a case by those of existing copies."""
    files = list_effect_files(text)
    own = [
        f"{make_effect_folder(copy).name}/{name}" if (make_effect_folder(copy) / name).is_file() else name
        for name in files
    ]
    return text if own == files else with_effect_files(text, own)
