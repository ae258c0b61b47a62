"""Thresholds of a layout into the file that is shipped: ``python -m study.diagnose.ship CASE CAMPAIGN [TRIALS]``."""

import json
import sys
from pathlib import Path

from correlation.campaign.read_campaign import read_campaign
from diagnosis.threshold.thresholds import Thresholds
from pipeline.output import replace_file
from pipeline.progress import LineProgress, Progress
from pipeline.store import Store, default_folder
from study.case.setup import read_case
from study.diagnose.round import beside, bootstrap, kept
from study.diagnose.thresholds import SHIPPED, layout, layout_key

#: Campaigns without any effect, unless another number is given.
TRIALS = 200


def ship(case: Path, folder: Path, trials: int, store: Store, progress: Progress, file: Path = SHIPPED) -> Thresholds:
    """Measure what chance does in a layout, and write it into the file of shipped limits.

    Parameters
    ----------
    case, folder
        A test case, and a campaign in the layout.
    trials
        Campaigns without any effect.
    store, progress
        Where each is kept, and what shows the time left.
    file
        Of all shipped limits; those of other layouts stay.
    """
    campaign = read_campaign(folder)
    setup = beside(read_case(case, campaign).setup, campaign)
    without = tuple(sorted(setup.without))
    limits = bootstrap(setup, campaign, without, trials, kept(store, setup, campaign, without), store, progress, None)
    of = layout(setup, campaign, setup.candidates(campaign, without))
    known = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    known[layout_key(of)] = {"limits": vars(limits), "layout": of}
    replace_file(file, f"{json.dumps(known, indent=1, ensure_ascii=False)}\n")
    return limits


if __name__ == "__main__":
    number = int(sys.argv[3]) if len(sys.argv) > 3 else TRIALS
    found = ship(Path(sys.argv[1]), Path(sys.argv[2]), number, Store(default_folder()), LineProgress())
    sys.stdout.write(f"{found}\n")
