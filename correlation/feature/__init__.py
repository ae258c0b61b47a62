"""Features: numbers that are compared, averaged over repeats and sweeps, beside those of a model."""
