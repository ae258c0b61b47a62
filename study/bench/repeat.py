"""Functions for exported scripts: open a bench, and print the numbers of each call as a line of JSON."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path

from pipeline.cache_folder import default_folder
from pipeline.store import Store
from study.bench.bench import Bench, CallResult
from study.json_value import to_json
from study.run_context import RunContext, silent_run


def open_bench(
    case: Path, folder: Path, without: Sequence[str] = (), cache: Path | None = None, *, is_copy: bool = False
) -> Bench:
    """Open a bench with the user's stored results, without display of progress."""
    store = Store(cache or default_folder(), RunContext.warn)
    silent = silent_run()
    run = RunContext(output=None, store=store, progress=silent.progress, json=False, quiet=True)
    return Bench(case, folder, run, without, is_copy=is_copy)


def show(result: CallResult) -> None:
    """Print the numbers of a call as one line of JSON."""
    sys.stdout.write(f"{json.dumps(to_json(result.numbers), ensure_ascii=False)}\n")
    sys.stdout.flush()
