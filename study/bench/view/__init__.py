"""Views of the page of the bench, as plain data: one file per part of the page."""
