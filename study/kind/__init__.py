"""Kinds of structures, one folder per kind: where the matrices come from."""
