"""Formats of sparse matrices, one file each."""
