"""Features: the numbers of a campaign that are compared with a model, averaged over repeats and sweeps."""
