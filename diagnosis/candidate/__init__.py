"""Candidate effects: what one is, where it may act, how strong it must be to matter, and the list of all."""
