"""Formats of campaigns, one a file; `FORMATS` finds them."""

from correlation.campaign.format.registry import FORMATS, CampaignFormat

__all__ = ["FORMATS", "CampaignFormat"]
