"""What an exported script calls: a copy of the case to work on, and the numbers of each call as a line of JSON."""

import json
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from pipeline.cache_folder import default_folder
from pipeline.store import Store
from study.bench.bench import Bench, Result
from study.diagnose.history import history_file, write_beside
from study.json_value import plain
from study.run_context import RunContext, silent_run


@contextmanager
def copy_beside(case: Path, text: str, history: str) -> Iterator[Path]:
    """A copy of a case beside it, where it finds the same files; it is removed in the end.

    Parameters
    ----------
    case
        The case.
    text, history
        What the copy and its history say; no history if that is empty.

    Raises
    ------
    OutputError
        The folder cannot be written.
    """
    with tempfile.NamedTemporaryFile(dir=case.parent, prefix=f".{case.stem}-", suffix=".toml", delete=False) as stream:
        copy = Path(stream.name)
    try:
        write_beside(copy, text)
        if history:
            write_beside(history_file(copy), history)
        yield copy
    finally:
        for file in (copy, history_file(copy)):
            file.unlink(missing_ok=True)


def open_bench(case: Path, folder: Path, without: Sequence[str] = (), cache: Path | None = None) -> Bench:
    """Bench with the user's stored results, that shows no progress."""
    store = Store(cache or default_folder(), RunContext.warn)
    silent = silent_run()
    run = RunContext(output=None, store=store, progress=silent.progress, json=False, quiet=True)
    return Bench(case, folder, run, without)


def show(result: Result) -> None:
    """Print the numbers of a call as one line of JSON."""
    sys.stdout.write(f"{json.dumps(plain(result.numbers), ensure_ascii=False)}\n")
    sys.stdout.flush()
