"""The beam of the virtual test bench as a case."""
