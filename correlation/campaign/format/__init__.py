"""Formats of campaigns, one per file; `FORMATS` finds them."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from correlation.campaign.measurement import Campaign
from geometry.registry import Registry

__all__ = ["FORMATS", "CampaignFormat"]


@dataclass(frozen=True, kw_only=True)
class CampaignFormat:
    """Format of the files of a campaign.

    Parameters
    ----------
    name
        Name of the format.
    holds
        Description of the path that a user gives, such as "a folder with campaign.toml".
    recognise
        Function that decides whether a path has this format; it reads as little as possible and never fails.
    read
        Reads the campaign at a path, in SI, peak amplitudes of e^{+i k Omega t}; raises `CampaignError` in one
        sentence.
    write
        Writes a campaign to a path for `read`; None for a format that is only read.
    """

    name: str
    holds: str
    recognise: Callable[[Path], bool]
    read: Callable[[Path], Campaign]
    write: Callable[[Campaign, Path], None] | None


def _wrong(format_: CampaignFormat) -> str | None:
    if not (isinstance(format_.holds, str) and format_.holds.strip()):
        return f"has holds = {format_.holds!r}: say what a user gives, in words"
    for fact in ("recognise", "read"):
        if not callable(getattr(format_, fact)):
            return f"has {fact} = {getattr(format_, fact)!r}: give a function of a path"
    return None


FORMATS: Registry[CampaignFormat] = Registry(
    "campaign format",
    package="correlation.campaign.format",
    group="stickslip.campaign_formats",
    facts={
        "holds": "what a user gives, in words",
        "recognise": "a function of a path that says whether it is one",
        "read": "a function of a path",
        "write": "a function of a campaign and a path, or None",
    },
    check=_wrong,
)
