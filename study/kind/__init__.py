"""Kinds of cases, one folder each: where the matrices of a structure come from."""
