"""Time integration of jointed systems: an independent check of the harmonic balance."""
