"""Noise: variance from few repeats, errors that many numbers share, differences in units of both."""
