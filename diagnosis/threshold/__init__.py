"""Detection thresholds: how large gain and misfit are when nothing is missing."""
