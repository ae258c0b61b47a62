"""Harmonic balance: the Fourier convention, dynamic stiffness and forced response. Knows nothing of measurements."""
