"""Mesh formats, one file each."""
