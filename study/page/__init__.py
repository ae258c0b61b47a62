"""Self-contained HTML pages: parts shared by the pages of all commands."""
