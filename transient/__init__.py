"""Time integration of jointed systems with a contact marching of its own: the witness of the harmonic balance."""
