"""Noise: variance from few repeats, errors common to many features, and their covariance."""
