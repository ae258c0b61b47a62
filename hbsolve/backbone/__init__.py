"""Nonlinear modes: frequency, damping and shape of a mode against its amplitude."""
