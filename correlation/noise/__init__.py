"""Noise: variance from few repeats, errors that many numbers share, and their covariance."""
