"""What the page of the bench draws, as plain data: one file per part of the page."""
