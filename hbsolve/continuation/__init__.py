"""Continuation: curves of periodic responses over frequency, level or a parameter, and their peaks."""
