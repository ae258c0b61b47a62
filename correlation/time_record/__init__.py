"""Time records beside a model: the response to a measured force, sample by sample."""
