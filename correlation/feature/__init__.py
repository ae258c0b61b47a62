"""Features: values of a campaign for comparison with a model, averaged over repeats and sweeps."""
