"""Whether a campaign has the repeats and the held-out data that a study needs: asked before anything is computed."""

from pathlib import Path

import numpy as np

from correlation.campaign.manifest import MANIFEST
from correlation.campaign.measurement import Campaign
from correlation.errors import CampaignError


def require_held_out(campaign: Campaign, folder: Path) -> None:
    """Refuse a campaign without anything that can test a fit.

    Raises
    ------
    CampaignError
        Nothing is held out.
    """
    if not (campaign.held_out.levels or campaign.held_out.repeats):
        last = campaign.measurement.repeat.max()
        raise CampaignError(
            f"{folder / MANIFEST}: nothing is held out, so that no effect can be tested: name a level or a repeat "
            f"under [held_out], e.g. repeats = [{last}]"
        )


def require_repeats(campaign: Campaign, folder: Path) -> None:
    """Refuse a campaign that does not tell its noise.

    Raises
    ------
    CampaignError
        It has one repeat alone.
    """
    repeats = np.unique(campaign.measurement.repeat)
    if len(repeats) == 1:
        files = ", ".join(sorted(file.name for file in folder.glob("*.csv")))
        raise CampaignError(
            f"{folder}: repeat = {repeats[0]} in every row of {files}: noise cannot be told from effects; measure the "
            "same once more, and number it in the column repeat"
        )
