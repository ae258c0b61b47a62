"""Harmonic balance: the Fourier convention, dynamic stiffness and forced response, independent of measurements."""
