"""The measured campaign of a command; results of its long analyses are stored for all commands."""

import tomllib
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

from correlation.campaign.manifest import MANIFEST
from correlation.campaign.measurement import Campaign
from correlation.campaign.read_campaign import read_campaign
from correlation.data_type.registry import DATA_TYPES, Analyse
from pipeline.store import Stage, Store
from study.run_context import RunContext


def read_measured(folder: Path, run: RunContext) -> Campaign:
    """`read_campaign` as a step of a run.

    Parameters
    ----------
    folder
        Folder of the campaign.
    run
        Run whose store keeps the results of analyses, such as modes of ring-downs and of frequency responses.

    Raises
    ------
    CampaignError
        See `read_campaign`.
    """
    total = _count_analyses(folder)
    with run.progress.step("campaign", expected=None if total else 1) as report:
        analyse, done = keep_analyses(run.store), count()

        def analyse_and_report(compute: Any, *args: Any, **words: Any) -> Any:
            result = analyse(compute, *args, **words)
            report(min(next(done) + 1, total), total)
            return result

        return read_campaign(folder, analyse_and_report)


def _count_analyses(folder: Path) -> int:
    """Number of entries of a manifest whose analysis takes long; 0 without a manifest that can be read."""
    path = folder if folder.is_file() else folder / MANIFEST
    try:
        manifest = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError):
        return 0
    entries = [manifest.get(kind.table) for kind in DATA_TYPES if kind.check is not None]
    return sum(len(item) for item in entries if isinstance(item, list))


def keep_analyses(store: Store) -> Analyse:
    """Make a function that runs analyses of data and stores their results for all commands with the same data."""
    return partial(_keep, store)


def _keep(store: Store, compute: Any, *args: Any, **words: Any) -> Any:
    stage = Stage(name=f"{compute.__module__}.{compute.__qualname__}", compute=compute, ignore=frozenset())
    return store.run(stage, *args, **words)
