"""Candidate effects: where each may act and how strong it must be to matter; the catalogue of all."""
