"""Candidate effects, one a file."""
