"""Metrics: differences between responses, and location of the errors of a model."""
