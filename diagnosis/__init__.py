"""Diagnosis: which physical effect is missing from a model."""
