"""Command line, cases and their models, runs, pages and reports."""
