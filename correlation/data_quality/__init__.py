"""Quality of measured data: suspected mistakes in a campaign, with numerical evidence."""
