"""The campaign of a command, whose long analyses are done once for all commands."""

from functools import partial
from pathlib import Path
from typing import Any

from correlation.campaign.measurement import Campaign
from correlation.campaign.read_campaign import read_campaign
from correlation.data_type.registry import Analyse
from pipeline.store import Stage, Store
from study.run_context import RunContext


def read_measured(folder: Path, run: RunContext) -> Campaign:
    """`read_campaign` as a step of a run.

    Parameters
    ----------
    folder
        Of the campaign.
    run
        Its store keeps what analyses found, such as modes of ring-downs and of frequency responses.

    Raises
    ------
    CampaignError
        As `read_campaign`.
    """
    with run.progress.step("campaign", expected=1):
        return read_campaign(folder, keep_analyses(run.store))


def keep_analyses(store: Store) -> Analyse:
    """Analyses of data that a store keeps, for all commands that read the same numbers."""
    return partial(_keep, store)


def _keep(store: Store, compute: Any, *args: Any, **words: Any) -> Any:
    stage = Stage(name=f"{compute.__module__}.{compute.__qualname__}", compute=compute, ignore=frozenset())
    return store.run(stage, *args, **words)
