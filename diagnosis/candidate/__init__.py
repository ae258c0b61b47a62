"""Candidate effects: places and typical strengths of each kind; catalogue of all candidates."""
