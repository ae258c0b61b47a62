"""Fits: parameters of a model and strengths of effects, by generalised least squares."""
