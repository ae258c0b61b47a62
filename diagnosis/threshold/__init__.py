"""Detection thresholds, from the distribution of the gains of effects and of unknown forces if nothing is missing."""
