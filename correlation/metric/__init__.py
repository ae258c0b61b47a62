"""Metrics: how far a response is from another, and where a model fails."""
