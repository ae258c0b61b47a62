"""The virtual test bench: a beam of its own, swept in time, measured with noise, with an effect hidden in it."""
