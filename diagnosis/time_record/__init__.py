"""Diagnosis of time records."""
