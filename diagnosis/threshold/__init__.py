"""Detection thresholds: how large the gains of effects and of unknown forces are when nothing is missing."""
