"""Add the detection thresholds of a layout to the shipped ones.

Run it as ``python -m study.diagnose.ship_thresholds CASE CAMPAIGN [TRIALS]``.
"""

import json
import sys
from pathlib import Path

from correlation.campaign.read_campaign import read_campaign
from diagnosis.threshold.detection_threshold import Thresholds
from pipeline.cache_folder import default_folder
from pipeline.output import replace_file
from pipeline.progress import LineProgress, Progress
from pipeline.store import Store
from study.case.setup import read_case
from study.diagnose.round import Steps, prepare_setup, simulate_thresholds
from study.diagnose.thresholds import SHIPPED, hash_layout, layout

#: Default number of campaigns without any effect.
TRIALS = 200


def write_shipped_thresholds(
    case: Path, folder: Path, trials: int, store: Store, progress: Progress, file: Path = SHIPPED
) -> Thresholds:
    """Simulate the detection thresholds of a layout, and write them into the shipped file.

    Parameters
    ----------
    case, folder
        A case, and a campaign in the layout.
    trials
        Number of simulated campaigns without any effect.
    store, progress
        Store of the campaigns, and progress.
    file
        The shipped file; its other layouts are kept.
    """
    campaign = read_campaign(folder)
    setup, _ = prepare_setup(read_case(case, campaign).setup, campaign, store)
    without = tuple(sorted(setup.without))
    thresholds = simulate_thresholds(
        setup, campaign, without, trials, Steps(store, setup, campaign, without), store, progress, None
    )
    described = layout(setup, campaign, setup.candidates(campaign, without))
    known = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    known[hash_layout(described)] = {"thresholds": vars(thresholds), "layout": described}
    replace_file(file, f"{json.dumps(known, indent=1, ensure_ascii=False)}\n")
    return thresholds


if __name__ == "__main__":
    number = int(sys.argv[3]) if len(sys.argv) > 3 else TRIALS
    thresholds = write_shipped_thresholds(
        Path(sys.argv[1]), Path(sys.argv[2]), number, Store(default_folder()), LineProgress()
    )
    sys.stdout.write(f"{thresholds}\n")
