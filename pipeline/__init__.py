"""Stages of a long computation: stored results, processes, progress, output files."""
