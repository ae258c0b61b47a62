"""Quality of measured data: what looks wrong in a campaign, with its evidence in numbers."""
